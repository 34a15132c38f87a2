"""Summarize a filtered recording while its rows pass."""

from collections.abc import Iterable, Iterator

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.mechanics.kinematics import FilteredRecording


class Summary:
    """Quality of a filtered recording; every array is (J,)."""

    def __init__(self, motion: FilteredRecording) -> None:
        self.cutoff_hz = motion.cutoff.hz
        self.why = motion.cutoff.reason
        self.segments = len(motion.stretches)
        self.samples = 0
        self._valid = 0
        self._joints = motion.joints
        self._noise = _MeanSquare(len(motion.joints))
        self._velocity = _MeanSquare(len(motion.joints))

    def passing(self, pieces: Iterable[pa.Table]) -> Iterator[pa.Table]:
        """Yield the motion's rows unchanged, and gather their statistics.

        Parameters
        ----------
        pieces : iterable of pyarrow.Table
            Rows of ``motion/1`` in order.

        Yields
        ------
        pyarrow.Table
            The same rows.
        """
        for piece in pieces:
            self._add(piece)
            yield piece

    def _add(self, piece: pa.Table) -> None:
        valid = piece["valid"].to_numpy()
        self.samples += piece.num_rows
        self._valid += int(valid.sum())

        def stacked(quantity: str) -> NDArray:
            return np.column_stack(
                [piece[joint.column(quantity)].to_numpy() for joint in self._joints]
            )[valid]

        # A well-chosen cut-off removes noise only, so the difference measures the encoder.
        self._noise.add(stacked("angle_measured") - stacked("angle"))
        # Not every drive reports a velocity of its own.
        if {joint.column("velocity_measured") for joint in self._joints} <= set(piece.column_names):
            self._velocity.add(stacked("velocity_measured") - stacked("velocity"))

    @property
    def valid_share(self) -> float:
        """Share of the samples that a fit may use."""
        return self._valid / self.samples

    @property
    def noise(self) -> NDArray:
        """Rms of measured less filtered angle, (J,) rad."""
        return self._noise.root

    @property
    def velocity_difference(self) -> NDArray | None:
        """Rms of the drive's less the filtered velocity, (J,) rad/s; None if not recorded."""
        return self._velocity.root if self._velocity.count.any() else None


class _MeanSquare:
    """Accumulate a root mean square over pieces (n, J), without missing values."""

    def __init__(self, columns: int) -> None:
        self.count = np.zeros(columns)
        self._total = np.zeros(columns)

    def add(self, x: NDArray) -> None:
        # Missing readings are NaN and must not count as zero; one drive may miss what another has.
        self.count += np.sum(~np.isnan(x), axis=0)
        self._total += np.nansum(x**2, axis=0)

    @property
    def root(self) -> NDArray:
        return np.sqrt(self._total / self.count)
