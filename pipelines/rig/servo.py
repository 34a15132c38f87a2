"""What a virtual drive makes of control words, set-points and silence: when its motor follows, and
where to."""

from math import ceil, floor, isfinite

from pipelines.settings.rig.register_map import DriveMap

EXTRAPOLATED = 5
"""Cycles over which a drive goes on at its set-points' speed when none comes; then it slows
down."""
EARLY, LATE = 0.25, 0.5
"""Shares of a cycle by which a set-point is clearly that one and not another, though it comes early
or late."""
CATCH = 0.02
"""Share of how early or late a set-point comes that the drive's own cycles follow."""


class Servo:
    """The logic of one drive, a sample at a time."""

    def __init__(
        self,
        registers: DriveMap,
        rest: float,
        angle_rad: tuple[float, float],
        sample_rate_hz: float,
        deceleration_rad_s2: float,
        heartbeat_s: float | None,
        samples_per_cycle: int = 1,
    ) -> None:
        """Be a disabled drive at rest.

        Parameters
        ----------
        rest : float
            Where it stands, rad.
        angle_rad : (low, high)
            Its joint's limits, rad.
        deceleration_rad_s2 : float
            How it slows down when nothing is told any more.
        heartbeat_s : float or None
            How long it may be told nothing before it disables itself; None for a drive without such
            a watchdog.
        samples_per_cycle : int
            Samples from one set-point to the next, a cycle. It goes to each in a straight line, to
            be there a cycle after it was at the one before: set-points that come a little early or
            late move it no less evenly.
        """
        self.fault = False
        """Latched until a fault reset, and no drive with a fault is enabled."""
        self._map = registers
        self._cycle = samples_per_cycle
        self._limits = angle_rad
        self._slowing = deceleration_rad_s2 / sample_rate_hz**2
        self._patience = None if heartbeat_s is None else ceil(heartbeat_s * sample_rate_hz)
        self._set_point, self._control = rest, registers.disable
        self._last, self._step, self._unheard = rest, 0.0, 0
        self._pace = 0.0
        self._from, self._way = rest, float(samples_per_cycle)
        """Where it was when the set-point came, and samples from then to when it is to be
        reached."""

    @property
    def enabled(self) -> bool:
        """Whether the motor follows."""
        return not self.fault and self._control in (self._map.enable, self._map.halt)

    @property
    def status(self) -> int:
        """The status word; a bit that the map gives no meaning stays 0."""
        # A bit that means a fault does not say that the drive is merely disabled, though it is 0
        # while it is enabled.
        is_enabled, mask = self._map.enabled_value, self._map.enabled_mask & ~self._map.fault_mask
        word = is_enabled if self.enabled else is_enabled ^ mask
        # The lowest bit that means a fault: which of them it is, the map does not tell.
        return word | (self._map.fault_mask & -self._map.fault_mask if self.fault else 0)

    def receive(self, reference: float, control: int) -> None:
        """Take a set-point (rad) and a control word."""
        # It holds where it is told no number: arithmetic would carry that on for ever.
        set_point = reference if isfinite(reference) else self._last
        cycles = self._cycles_to(set_point)
        # The set-points' own speed: the way back from having gone on too far is none to go on at.
        if cycles:
            self._pace = (
                (set_point - self._set_point) / (cycles * self._cycle) if self.enabled else 0.0
            )
        # A cycle after the one before was to be reached; by and by a cycle after it comes.
        way = self._way - self._unheard + cycles * self._cycle
        self._from, self._way = self._last, max(way + CATCH * (self._cycle - way), 1.0)
        self._unheard = 0
        if control == self._map.fault_reset:
            self.fault = False
        self._set_point, self._control = set_point, control

    def _cycles_to(self, set_point: float) -> int:
        """Return how many set-points a new one (rad) is after the last one; 0 where it corrects
        that.

        The time tells; what is very late could be another one, and is what goes on at their speed.
        """
        waited = (self._unheard + self._cycle - self._way) / self._cycle
        if (clear := floor(waited + EARLY)) != floor(waited - LATE):
            return clear
        return min(
            max(floor(waited), 0),
            ceil(waited),
            key=lambda n: abs(set_point - self._set_point - n * self._cycle * self._pace),
        )

    def next(self, angle: float) -> tuple[float, bool]:
        """Return the set-point (rad) for the next sample and whether the motor follows it.

        While it does not, the set-point is the measured ``angle`` (rad), so that enabling begins
        without a jump.
        """
        reference = self._reference() if self.enabled else angle
        self._step, self._last = reference - self._last, reference
        self._unheard += 1
        if (
            self.enabled
            and self._patience is not None
            and self._unheard > self._patience
            and self._step == 0.0
        ):
            self.fault = True
        return reference, self.enabled

    def _reference(self) -> float:
        if self._control == self._map.halt:
            return self._last
        if (after := self._unheard + 1) <= self._way:
            return self._from + (self._set_point - self._from) * after / self._way
        reference = self._set_point + self._pace * (after - self._way)
        if self._unheard >= self._cycle * (1 + EXTRAPOLATED):
            slower = max(abs(self._step) - self._slowing, 0.0)
            reference = self._last + (slower if self._step > 0 else -slower)
        low, high = self._limits
        return min(max(reference, low), high)
