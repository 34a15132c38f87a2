"""Whether an angle starts again after a turn, which the rig file does not say."""

from collections.abc import Iterator
from math import pi

import numpy as np

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series


def check_turns(probe: Probe, series: Series) -> Iterator[Finding]:
    """Yield a finding where the angle leaps by a turn, or a register's range, and goes on.

    Parameters
    ----------
    probe : Probe
        A device that is only read.
    series : Series
        Repeated readings of its block.
    """
    register = series.block.registers.get("angle")
    if register is None or register.turn or len(series.fresh) < 2:
        return
    per_count = abs(register.si[0])
    counts = series.of("angle")[series.fresh] / per_count
    steps = np.abs(np.diff(counts))
    # A leap is half of all that the angle does; all else is small beside it.
    leaps = steps > 0.5 * np.ptp(counts)
    if not leaps.any() or leaps.all():
        return
    usual = float(steps[~leaps].max())
    if usual > 0.125 * steps[leaps].min():
        return
    for full in (2.0 * pi / per_count, *(2.0**bits for bits in range(8, 33))):
        if (np.abs(steps[leaps] - full) <= 2.0 * usual + 1.0).all():
            where = f"{probe.map_path}.read.angle"
            yield Finding(
                probe.name,
                f"angle leaps by {full:.10g} counts and goes on from there: it starts again after a"
                f" turn; set {where}.wraps_at = {full:.10g}, and turns = true at the joint in"
                " [mechanism]",
                "angle",
                is_explained=True,
            )
            return
