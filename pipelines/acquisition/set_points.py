"""Set-points that are computed when they come due, so that a long run takes no more memory."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

BLOCK = 256
"""Set-points that are computed at once while the leg moves; few, as no sample may wait."""
PIECE = 65536
"""Set-points that are looked at at once before."""


class SetPoints:
    """Set-points (n, J) rad of way in, run and way out, indexed like an array's rows."""

    def __init__(
        self, lead_in: NDArray, run: Callable[[int, int], NDArray], samples: int, lead_out: NDArray
    ) -> None:
        """Join ways in and out, (n, J) rad, with a run, which ``run`` computes in parts."""
        self.first, self.stop = len(lead_in), len(lead_in) + samples
        self._lead_in, self._run, self._lead_out = lead_in, run, lead_out
        self._begin, self._block = 0, lead_in[:0]

    def __len__(self) -> int:
        return self.stop + len(self._lead_out)

    def __getitem__(self, index: int) -> NDArray:
        if index < 0:
            raise IndexError(f"set-point {index}: the first one is 0")
        if not self._begin <= index < self._begin + len(self._block):
            # Set-points come due in order, and each cycle asks for the last ones too: so a block
            # begins a little before the index.
            self._begin = max(index - BLOCK // 4, 0)
            self._block = self.between(self._begin, min(self._begin + BLOCK, len(self)))
        return self._block[index - self._begin]

    def __array__(self, dtype: type | None = None, copy: bool | None = None) -> NDArray:
        return self.between(0, len(self))

    def between(self, begin: int, end: int) -> NDArray:
        """Return some set-points.

        Parameters
        ----------
        begin, end : int
            First index, and the index before which to end.

        Returns
        -------
        (end - begin, J) array
            rad.
        """
        # Slices beyond an array's end are empty, so each part contributes only its own rows.
        first, stop = self.first, self.stop
        before = self._lead_in[begin:end]
        after = self._lead_out[max(begin - stop, 0) : max(end - stop, 0)]
        begin, end = max(begin, first), min(end, stop)
        run = [self._run(begin - first, end - first)] if begin < end else []
        return np.concatenate([before, *run, after])

    def pieces(self) -> Iterator[tuple[int, NDArray]]:
        """Yield all set-points in pieces; a piece begins with the last one of the piece before.

        Yields
        ------
        tuple
            Index of the first, and set-points (k, J), rad.
        """
        for begin in range(0, len(self), PIECE):
            yield max(begin - 1, 0), self.between(max(begin - 1, 0), min(begin + PIECE, len(self)))
