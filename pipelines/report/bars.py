"""Bars as data: the parts of a joint's error, and its fall once the causes are named."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Segment:
    """A part of a bar, from ``low`` to ``high`` of the bar's quantity."""

    key: str
    label: str
    tone: str
    """Name of its colour."""
    low: float
    high: float
    share: float
    """Its mean square; negative where a cause raises a joint's error."""

    @property
    def rms(self) -> float:
        """Root mean square, with the sign of the share."""
        # Mean squares add up, rms values do not: bars are laid in the former, numbers given in the
        # latter.
        return float(np.copysign(np.sqrt(abs(self.share)), self.share))


@dataclass(frozen=True)
class Bar:
    """One joint's mean square error, its parts laid end to end."""

    joint: str
    unit: str
    segments: tuple[Segment, ...]

    @property
    def total(self) -> float:
        """Mean square of the whole error."""
        return sum(segment.share for segment in self.segments)

    @property
    def rms(self) -> float:
        """Root mean square of the whole error."""
        return float(np.sqrt(self.total))

    @property
    def low(self) -> float:
        """Start of the bar: negative where a cause raises the error."""
        return min(0.0, *(segment.low for segment in self.segments))

    @property
    def high(self) -> float:
        """End of the bar."""
        return max(segment.high for segment in self.segments)


@dataclass(frozen=True)
class Fall:
    """One joint's error without and with the causes, and its noise floor."""

    joint: str
    unit: str
    before: float
    after: float | None
    """None if no cause is named."""
    floor: float
    unexplained: float | None
    """Share of the excess over the floor that remains; None without an excess."""
    torque: float | None = None
    """Rms of the measured torque; None in files of older versions."""

    @property
    def highest(self) -> float:
        """The largest of error before, error after and floor."""
        # The floor, too, because it may lie above every error.
        return max(self.before, self.after or 0.0, self.floor)
