"""What every tool is asked, and in which terms its answer is compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tests.campaigns.blind.excitation import baseline_columns

NAMES = ("X1", "X2", "X3", "X4", "hip coulomb", "knee coulomb", "hip viscous", "knee viscous")
"""Of the rigid leg and its friction, in the order of ``baseline_columns``: the model that every
tool is given."""


@dataclass(frozen=True)
class Log:
    """One run as a recording holds it, without gaps. n samples, two joints; SI units."""

    time: NDArray
    angle: NDArray
    torque: NDArray
    length: float
    gravity: float
    reference: NDArray | None = None
    velocity: NDArray | None = None
    """The drive's own."""
    kp: NDArray | None = None
    kd: NDArray | None = None

    @property
    def rate_hz(self) -> float:
        """Mean rate."""
        return (len(self.time) - 1) / (self.time[-1] - self.time[0])


@dataclass(frozen=True)
class Answer:
    """What a tool found and what it says of its result."""

    tool: str
    values: NDArray
    """(8,) in the order of ``NAMES``."""
    names: Sequence[str]
    """(p,) of the tool's own parameters."""
    own: NDArray
    """(p,) their values, for which it gives intervals."""
    half_width: NDArray
    """(p,) of its 95 % intervals."""
    to_own: Callable[[NDArray], NDArray]
    """From values of ``NAMES`` to the tool's own parameters."""
    seconds: float
    """Of processor time."""
    says: Sequence[str] = field(default_factory=tuple)
    """What it says of the result in words."""

    def inside(self, truth: NDArray) -> NDArray:
        """Which of its intervals hold what is true, (p,) bool."""
        return np.abs(self.own - self.to_own(truth)) <= self.half_width

    def half_widths_off(self, truth: NDArray) -> NDArray:
        """How far each estimate is from what is true, in half-widths, (p,)."""
        return np.abs(self.own - self.to_own(truth)) / self.half_width

    def torque(self, q: NDArray, dq: NDArray, ddq: NDArray, log: Log) -> NDArray:
        """Torque that its model predicts along a motion, (n, 2) N·m."""
        return baseline_columns(q, dq, ddq, log.length, log.gravity) @ self.values
