"""What no run in real time can do with a rig file at a rate, whatever its devices answer."""

from collections.abc import Callable
from functools import partial

from pipelines.acquisition.modbus.line_rate import refuse_slow_lines
from pipelines.acquisition.preconditions.drive_watchdog import refuse_short_heartbeat
from pipelines.acquisition.safety.watchdog import refuse_short_watchdog
from pipelines.settings.rig import RigSettings


def refusals(*, with_sensors: bool) -> tuple[Callable[[RigSettings, float], None], ...]:
    """Return what refuses a rig at a sample rate, Hz, each by a SettingsError that tells the
    key."""
    return (
        refuse_short_watchdog,
        partial(refuse_slow_lines, with_sensors=with_sensors),
        partial(refuse_short_heartbeat, with_sensors=with_sensors),
    )
