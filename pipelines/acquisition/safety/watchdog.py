"""How long it is borne that somebody says nothing."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings

FEWEST_SAMPLES = 3
"""That the watchdog waits for: one that is late and one that is lost are no reason to stop a
leg."""


def refuse_short_watchdog(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse a watchdog that would bite between two samples.

    Raises
    ------
    SettingsError
        Tells how long it should wait.
    """
    least = FEWEST_SAMPLES / sample_rate_hz
    if rig.safety.watchdog_s < least:
        raise SettingsError(
            f"safety.watchdog_s: found {rig.safety.watchdog_s:g}, expected at least {least:.3g},"
            f" {FEWEST_SAMPLES} samples at {sample_rate_hz:g} Hz, or it stops every run; raise it"
        )


class Patience:
    """The time since somebody was heard last; instants ``now`` are the host's, s."""

    def __init__(self, longest_s: float) -> None:
        self.longest_s = longest_s
        self._heard: float | None = None

    def hear(self, now: float) -> None:
        """Note that there was something to hear."""
        self._heard = now

    def waited(self, now: float) -> float:
        """Return for how long nothing was heard, s; the first question begins the wait."""
        if self._heard is None:
            self._heard = now
        return now - self._heard

    def is_over(self, now: float) -> bool:
        """Tell whether that is too long."""
        return self.waited(now) > self.longest_s
