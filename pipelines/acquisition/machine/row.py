"""What one cycle brings of the whole machine."""

from dataclasses import dataclass

from numpy.typing import NDArray

from pipelines.acquisition.machine.drive import Reading
from pipelines.errors import Unanswered


@dataclass(frozen=True)
class Row:
    """One sample of the whole machine."""

    drives: tuple[Reading, ...]
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had nothing new."""
    samples_per_cycle: int = 1

    @property
    def sequence(self) -> int:
        """The cycle it belongs to: the first drive's sample counter is the machine's."""
        return self.drives[0].sequence // self.samples_per_cycle

    @property
    def time(self) -> float:
        """The first drive's clock: the machine's, s."""
        return self.drives[0].time

    @property
    def angle(self) -> list[float]:
        """Angle of each joint, rad."""
        return [drive.angle for drive in self.drives]


@dataclass(frozen=True)
class Answers:
    """What one cycle brought, whole or not."""

    drives: tuple[Reading | Unanswered, ...]
    """Of a drive that did not answer in time, the error that says so."""
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had nothing new."""
    row: Row | None
    """The sample of the whole machine; None where a drive's is missing."""
