"""Values that stand still while a joint is told to move: since when, and how far it was told to go
meanwhile."""

from collections import deque
from dataclasses import dataclass

FROZEN_RAD, FROZEN_CYCLES = 0.03, 10
"""How far a joint is told to go, and in how many cycles, before a value that never changed is taken
for frozen; and how far what else is told of the joint must contradict it: a joint may stick to its
friction."""
ANSWER_CYCLES = 5
"""Cycles after which a joint has begun to go where it was told, whatever its drive takes for
that."""
KEPT = 1024
"""Set-points that are looked back on: a drive's records come after the exchanges between which they
were latched."""


@dataclass(frozen=True)
class SetPoint:
    """What a joint was told, and how far it had been told to go by then, rad."""

    reference: float
    travel: float


class Told:
    """A joint's set-points along its drive's own counter."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, SetPoint]] = deque(maxlen=KEPT)

    def tell(self, count: int, reference: float) -> None:
        """Note the set-point (rad) that was sent while a sample was the newest."""
        if self._sent and count < self._sent[-1][0]:
            return  # heard of late: the drive has been told more since
        last = self._sent[-1][1] if self._sent else SetPoint(reference, 0.0)
        self._sent.append(
            (count, SetPoint(reference, last.travel + abs(reference - last.reference)))
        )

    def at(self, count: int) -> SetPoint:
        """Return the set-point that was sent last when a sample was latched."""
        return next(
            (sent for known, sent in reversed(self._sent) if known <= count), self._sent[0][1]
        )


@dataclass
class Held:
    """A value that is told again and again."""

    value: object = None
    since: int = 0
    """The first sample that told it."""
    travel: float = 0.0
    """How far the joint had been told to go by then, rad."""
    gone: float = 0.0
    """How far it had gone by then by the speed that was told, rad; NaN where none is."""
    angle: float = 0.0
    """Where it was by the angle that was told, rad."""

    def tell(
        self, value: object, count: int, travel: float, gone: float = 0.0, angle: float = 0.0
    ) -> None:
        """Take the value of a sample, and what was known of the joint's motion then."""
        if value != self.value:
            self.value, self.since, self.travel, self.gone, self.angle = (
                value,
                count,
                travel,
                gone,
                angle,
            )
