"""The watchdog: stops a run when a device has not answered for too long."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings


def refuse_short_watchdog(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse a watchdog that expires between two samples.

    Raises
    ------
    SettingsError
        With the shortest time that is allowed.
    """
    # Samples that the watchdog waits for at least: a late one and a lost one are no reason to stop.
    fewest_samples = 3
    least = fewest_samples / sample_rate_hz
    if rig.safety.watchdog_s < least:
        raise SettingsError(
            f"safety.watchdog_s: found {rig.safety.watchdog_s:g}, expected at least {least:.3g},"
            f" {fewest_samples} samples at {sample_rate_hz:g} Hz, or it stops every run; raise it"
        )


class Watchdog:
    """The time since a device answered last; instants ``now`` are the host's, s."""

    def __init__(self, longest_s: float) -> None:
        """Wait for an answer, s at most."""
        self.longest_s = longest_s
        self._answered_at: float | None = None

    def reset(self, now: float) -> None:
        """Note an answer."""
        self._answered_at = now

    def waited(self, now: float) -> float:
        """Return the time since the last answer, s; the first call begins the wait."""
        if self._answered_at is None:
            self._answered_at = now
        return now - self._answered_at

    def has_expired(self, now: float) -> bool:
        """Return whether that is too long."""
        return self.waited(now) > self.longest_s
