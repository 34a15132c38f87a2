"""The set-points that a joint was sent, along its drive's own counter."""

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True)
class SetPoint:
    """A set-point, and how far the joint had been sent by then, rad."""

    reference: float
    travel: float


class SetPointHistory:
    """A joint's set-points along its drive's own counter."""

    def __init__(self) -> None:
        # As many are kept, since a drive's records come later than the exchanges.
        self._sent: deque[tuple[int, SetPoint]] = deque(maxlen=1024)

    def add(self, count: int, reference: float) -> None:
        """Note the set-point (rad) that was sent while a sample was the newest."""
        if self._sent and count < self._sent[-1][0]:
            return  # an answer that came late: the drive has been sent more since
        last = self._sent[-1][1] if self._sent else SetPoint(reference, 0.0)
        travel = last.travel + abs(reference - last.reference)
        self._sent.append((count, SetPoint(reference, travel)))

    def at(self, count: int) -> SetPoint:
        """Return the set-point that was sent last when a sample was latched."""
        earlier = (sent for known, sent in reversed(self._sent) if known <= count)
        return next(earlier, self._sent[0][1])
