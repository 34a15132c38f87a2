"""A value that stands still while its joint is sent to move."""

from dataclasses import dataclass

STUCK_RAD, STUCK_CYCLES = 0.03, 10
"""How far a joint is sent, and in how many cycles, before a value that never changed counts as
stuck; and how far other readings of the joint must contradict it: a joint may stick to its
friction."""
ANSWER_CYCLES = 5
"""Cycles after which a joint has begun to go where it was sent, whatever its drive takes for
that."""


@dataclass
class StuckValue:
    """A value that is read again and again: since when it is the same, and the motion since."""

    value: object = None
    since: int = 0
    """The first sample with this value."""
    sent_travel: float = 0.0
    """How far the joint had been sent by then, rad."""
    travel: float = 0.0
    """How far the joint had gone by then, by its measured velocity, rad; NaN without one."""
    angle: float = 0.0
    """Where the joint was then, by its measured angle, rad."""

    def update(
        self,
        value: object,
        count: int,
        sent_travel: float,
        travel: float = 0.0,
        angle: float = 0.0,
    ) -> None:
        """Take the value of a sample, and the joint's motion up to it."""
        if value == self.value:
            return
        self.value, self.since = value, count
        self.sent_travel, self.travel, self.angle = sent_travel, travel, angle
