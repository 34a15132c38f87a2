"""Whether an angle starts again after a turn, which no limit shows."""

from collections.abc import Iterator

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.leaps import leap


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
    if register is None:
        return
    full = leap(register, series.of("angle")[series.fresh], of_turn=True)
    if full is not None:
        where = f"{probe.map_path}.read.angle"
        yield Finding(
            probe.name,
            f"angle leaps by {full:.10g} counts and goes on from there: it starts again after a"
            f" turn; set {where}.wraps_at = {full:.10g}, and turns = true at the joint in"
            " [mechanism]",
            "angle",
            is_explained=True,
        )
