"""Whether an angle starts again after a turn, or a sign is misread, which no limit shows."""

from collections.abc import Iterator

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.leaps import leap_of
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
    full = leap_of(series, "angle", of_turn=True) if "angle" in series.block.names else None
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


def check_signs(probe: Probe, series: Series) -> Iterator[Finding]:
    """Yield a finding for each value of one register that leaps where it changes its sign.

    Parameters
    ----------
    probe : Probe
        A device that is only read.
    series : Series
        Repeated readings of its block.
    """
    for name, register in series.block.registers.items():
        if name in ("sequence", "time", "angle", "reference", "status") or register.registers > 1:
            continue
        full, where = leap_of(series, name), f"{probe.map_path}.read.{name}"
        if full == 2.0**16 and register.is_unsigned:
            remedy = f'negative values are read as large ones; set {where}.type = "int16"'
        elif full == 2.0**15:
            remedy = (
                f'it is a magnitude with a sign bit; set {where}.type = "uint16" and sign_bit = 15'
            )
        else:
            continue
        yield Finding(
            probe.name,
            f"{name} leaps by {full:.0f} counts where it changes its sign: {remedy}",
            name,
            is_explained=True,
        )
