"""Samples of the whole machine."""

from dataclasses import dataclass

from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import Reading
from pipelines.errors import Unanswered


@dataclass(frozen=True)
class Row:
    """One sample of the whole machine."""

    drives: tuple[Reading, ...]
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had no new sample."""
    samples_per_cycle: int = 1

    @property
    def sequence(self) -> int:
        """Number of the cycle, by the first drive's sample counter."""
        return self.drives[0].sequence // self.samples_per_cycle

    @property
    def time(self) -> float:
        """The first drive's clock, which is the machine's, s."""
        return self.drives[0].time

    @property
    def angle(self) -> list[float]:
        """Angle of each joint, rad."""
        return [drive.angle for drive in self.drives]


@dataclass(frozen=True)
class Answers:
    """The answers of one cycle, complete or not."""

    drives: tuple[Reading | Unanswered, ...]
    """For a drive that did not answer in time, the error."""
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had no new sample."""
    row: Row | None
    """The sample of the whole machine; None where a drive's sample is missing."""
