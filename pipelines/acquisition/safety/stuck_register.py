"""Registers that stand still while their joint is sent to move."""

from dataclasses import dataclass
from math import inf

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.safety.set_point_history import SetPointHistory

STUCK_RAD, STUCK_CYCLES = 0.03, 10
"""How far a joint is sent, and in how many cycles, before a value that never changed counts as
stuck; and how far other readings of the joint must contradict it: a joint may stick to its
friction."""
ANSWER_CYCLES = 5
"""Cycles after which a joint has begun to follow its set-points, whatever its drive is."""
CHANGING = {"angle": "rad", "velocity": "rad/s", "current": "A"}
"""Readings that change while a joint moves, with their units."""


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


class StuckRegisters:
    """The registers of one drive, each with the sample since which it stands still."""

    def __init__(
        self, label: str, samples_per_cycle: int, rate_hz: float, history: SetPointHistory
    ) -> None:
        """Watch a drive with a label, which takes samples at a rate and is sent a history."""
        self._label, self._rate, self._history = label, rate_hz, history
        self._lag = ANSWER_CYCLES * samples_per_cycle
        self._fewest = STUCK_CYCLES * samples_per_cycle
        self._values = {name: StuckValue() for name in CHANGING}
        self._travel = 0.0
        """How far the joint has gone by its measured velocity, rad; NaN without one."""

    def check(self, before: Reading, reading: Reading) -> str | None:
        """Return which register stands still while the joint is sent to move, and moves."""
        sent_travel = self._history.at(reading.sequence - self._lag).travel
        self._travel += reading.velocity * (reading.sequence - before.sequence) / self._rate
        for name, unit in CHANGING.items():
            last, value = self._values[name], getattr(reading, name)
            last.update(value, reading.sequence, sent_travel, self._travel, reading.angle)
            samples, sent = reading.sequence - last.since, sent_travel - last.sent_travel
            if samples < self._fewest or sent <= STUCK_RAD:
                continue
            seconds = samples / self._rate
            # NaN: nothing else is known.
            if not self._contradiction(name, last, reading, seconds) <= STUCK_RAD:
                return (
                    f"{self._label}: reports {name} {last.value:.6g} {unit} for {seconds:.3f} s,"
                    f" while it was sent {sent:.3f} rad; its register is frozen, or the joint"
                    " is blocked"
                )
        return None

    def _contradiction(
        self, name: str, last: StuckValue, reading: Reading, seconds: float
    ) -> float:
        """Return by how much angle or velocity contradict a value that stood still, rad."""
        # By the integral of the velocity, the only other measurement of the motion.
        if name == "angle":
            return abs(self._travel - last.travel)
        if name == "velocity" and reading.angle == last.angle and reading.velocity != 0.0:
            return inf  # one that stands has no speed
        # Compared with the travel that a constant speed would have given.
        if name == "velocity":
            return abs(reading.angle - last.angle - reading.velocity * seconds)
        return inf
