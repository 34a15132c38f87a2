"""The logic of a virtual drive: when its motor follows, and to which set-point."""

from math import ceil, floor, isfinite

from pipelines.settings.rig.register_map import DriveMap

EXTRAPOLATED = 5
"""Cycles for which a drive continues at its set-points' speed without one; then it slows down."""
EARLY, LATE = 0.25, 0.5
"""Shares of a cycle by which a set-point may come early or late and still be identified."""


class Servo:
    """The logic of one drive, sample by sample."""

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
        """Begin disabled and at rest.

        Parameters
        ----------
        rest : float
            Angle of the joint, rad.
        angle_rad : (low, high)
            Limits of the joint, rad.
        deceleration_rad_s2 : float
            Deceleration when set-points stay away.
        heartbeat_s : float or None
            Longest time without a set-point, after which the drive disables itself; None for a
            drive without a watchdog.
        samples_per_cycle : int
            Samples from one set-point to the next. The drive interpolates linearly, and reaches
            each set-point one cycle after the one before, even if they come unevenly.
        """
        self.fault = False
        """Latched until a fault reset; a drive with a fault is not enabled."""
        self._map = registers
        self._cycle = samples_per_cycle
        self._limits = angle_rad
        # Steps are in rad per sample, so this is in rad per sample squared.
        self._slowing = deceleration_rad_s2 / sample_rate_hz**2
        self._heartbeat_samples = (
            None if heartbeat_s is None else ceil(heartbeat_s * sample_rate_hz)
        )
        self._set_point, self._control = rest, registers.disable
        self._last, self._step = rest, 0.0
        self._since = 0
        """Samples since the last set-point."""
        self._pace = 0.0
        """Speed of the set-points, rad per sample."""
        self._from, self._way = rest, float(samples_per_cycle)
        """Angle when the set-point came, and samples from then until it is to be reached."""

    @property
    def enabled(self) -> bool:
        """Whether the motor follows set-points."""
        return not self.fault and self._control in (self._map.enable, self._map.halt)

    @property
    def status(self) -> int:
        """The status word; bits without a meaning in the map are 0."""
        # A fault bit may be part of enabled_mask, but must not be set by disabling alone.
        # A disabled drive shows all of these bits inverted, which cannot equal the enabled value.
        is_enabled, mask = self._map.enabled_value, self._map.enabled_mask & ~self._map.fault_mask
        word = is_enabled if self.enabled else is_enabled ^ mask
        # The lowest fault bit, as the map does not distinguish faults.
        return word | (self._map.fault_mask & -self._map.fault_mask if self.fault else 0)

    def receive(self, reference: float, control: int) -> None:
        """Accept a set-point and a control word.

        Parameters
        ----------
        reference : float
            Set-point, rad.
        control : int
            Control word.
        """
        # Gain by which the drive's cycles follow the set-points' instants.
        catch = 0.02
        # NaN would remain in the arithmetic for ever, so the drive holds instead.
        set_point = reference if isfinite(reference) else self._last
        cycles = self._cycles_to(set_point)
        # From the set-points alone: after an extrapolation the way back has another speed.
        if cycles and self.enabled:
            self._pace = (set_point - self._set_point) / (cycles * self._cycle)
        elif cycles:
            self._pace = 0.0
        # One cycle after the last set-point's; `catch` slowly adapts this to when set-points come.
        way = self._way - self._since + cycles * self._cycle
        self._from, self._way = self._last, max(way + catch * (self._cycle - way), 1.0)
        self._since = 0
        if control == self._map.fault_reset:
            self.fault = False
        self._set_point, self._control = set_point, control

    def _cycles_to(self, set_point: float) -> int:
        """Return the cycles from the last set-point to a new one (rad); 0 for a correction.

        The time decides. Where it is ambiguous, the set-points' speed does.
        """
        # In cycles since the last set-point should have come, one cycle before it is reached. From
        # n - EARLY to n + LATE the time means n.
        waited = (self._since + self._cycle - self._way) / self._cycle
        cycles = floor(waited + EARLY)
        if cycles != floor(waited - LATE):
            return cycles
        # Between n + LATE and n + 1 - EARLY, the speed of the set-points decides: n or n + 1.
        return min(
            max(floor(waited), 0),
            ceil(waited),
            key=lambda n: abs(set_point - self._set_point - n * self._cycle * self._pace),
        )

    def next(self, angle: float) -> tuple[float, bool]:
        """Return the set-point of the next sample, and whether the motor follows it.

        If it does not, the set-point is the measured angle, so that enabling the drive causes no
        jump.

        Parameters
        ----------
        angle : float
            Measured angle, rad.

        Returns
        -------
        tuple
            Set-point, rad, and whether the drive is enabled.
        """
        reference = self._reference() if self.enabled else angle
        self._step, self._last = reference - self._last, reference
        self._since += 1
        # A watchdog that expires in motion first lets the drive come to rest (docs/safety.md, 6.5).
        if (
            self.enabled
            and self._heartbeat_samples is not None
            and self._since > self._heartbeat_samples
            and self._step == 0.0
        ):
            self.fault = True
        return reference, self.enabled

    def _reference(self) -> float:
        if self._control == self._map.halt:
            return self._last
        # Three stretches: linear to the set-point, on at the set-points' speed, and slower until
        # rest.
        after = self._since + 1
        if after <= self._way:
            return self._from + (self._set_point - self._from) * after / self._way
        reference = self._set_point + self._pace * (after - self._way)
        if self._since >= self._cycle * (1 + EXTRAPOLATED):
            slower = max(abs(self._step) - self._slowing, 0.0)
            reference = self._last + (slower if self._step > 0 else -slower)
        low, high = self._limits
        return min(max(reference, low), high)
