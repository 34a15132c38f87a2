"""The turn in which the counters of several logs begin, which no counter shows by itself."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Finding, counted


class Beginnings:
    """First readings of the counters in the logs imported so far."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[float, str]] = {}

    def check(
        self, log: str, columns: Mapping[str, NDArray], turns: Mapping[str, float]
    ) -> Iterator[Finding]:
        """Report counters that begin more than half a turn from where those of the first log did.

        Parameters
        ----------
        log : str
            Name of the log in findings.
        columns : mapping of str to (n,) array
            The recording's columns, SI.
        turns : mapping of str to float
            A turn of each counter, SI.

        Yields
        ------
        Finding
            One for each such counter.
        """
        for name, turn in turns.items():
            known = columns[name][np.isfinite(columns[name])]
            if not len(known):
                continue
            begins = float(known[0])
            # No log shows its own turn, so the first one is the reference of all others.
            first, first_log = self._first.setdefault(name, (begins, log))
            # Less than half a turn may be motion between two logs.
            away = round((begins - first) / turn)
            if away:
                seen = (
                    f"begins at {begins:.4g}, in {first_log} at {first:.4g},"
                    f" {counted(abs(away), 'turn')} apart"
                )
                yield Finding(
                    name, seen, "kept; if all logs begin at the same reading, set begins_at to it"
                )
