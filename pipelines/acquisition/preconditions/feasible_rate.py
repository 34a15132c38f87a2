"""Checks of a sample rate in real time that need the rig file alone."""

from collections.abc import Callable
from functools import partial

from pipelines.acquisition.modbus.line_rate import refuse_slow_lines
from pipelines.acquisition.preconditions.drive_watchdog import refuse_short_heartbeat
from pipelines.acquisition.safety.watchdog import refuse_short_watchdog
from pipelines.settings.rig import RigSettings


def rate_checks(*, with_sensors: bool) -> tuple[Callable[[RigSettings, float], None], ...]:
    """Return functions that raise SettingsError where a rig is unfit for a sample rate, Hz."""
    return (
        refuse_short_watchdog,
        partial(refuse_slow_lines, with_sensors=with_sensors),
        partial(refuse_short_heartbeat, with_sensors=with_sensors),
    )
