"""Checks of an unloaded force sensor: its zero, its noise, and whether it is connected."""

from collections.abc import Iterator

import numpy as np

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.plausible import has_plausible_size
from pipelines.acquisition.check.probe import Probe, Series

AXES = ("force_x", "force_y", "force_z")


def check_zeros(
    probe: Probe, series: Series, limit_n: float, *, is_empty: bool
) -> Iterator[Finding]:
    """Yield findings about a sensor's zeros.

    Parameters
    ----------
    limit_n : float
        Limit of the force on a cuff, N.
    is_empty : bool
        Whether no person is in the machine; else the mean forces are not zeros.
    """
    # Largest allowed zero, as a share of safety.cuff_force_n.
    zero_share = 0.05
    # New samples without any noise that mean a disconnected sensor.
    enough = 20
    # Share of the register's range from which a force counts as saturated.
    near_end = 0.999
    # Of each new sample, (n, 3) N.
    forces = np.column_stack([series.of(axis) for axis in AXES])[series.fresh]
    if not has_plausible_size(forces).all():
        return  # the registers have to be corrected first
    where = f"{probe.map_path}.read"
    for i, axis in enumerate(AXES):
        # The register's end is compared in counts, as its SI value depends on scale and offset.
        mean, full = float(forces[:, i].mean()), series.block.registers[axis].counts
        scale, offset = series.block.registers[axis].si
        if full and np.mean(np.abs((forces[:, i] - offset) / scale) >= near_end * full[1]) > 0.5:
            yield probe.finding(
                f"{axis} is saturated at {mean:.4g} N, the end of its register; check the sensor's"
                f" cable and amplifier, or compare {where}.{axis} with its manual",
            )
        elif is_empty and abs(mean) > zero_share * limit_n:
            most = zero_share * limit_n
            yield probe.finding(
                f"{axis} is {mean:.4g} N with nobody in the machine, expected within ±{most:g} N;"
                f" tare the sensor, or correct {where}.{axis}.offset",
            )
    if len(forces) >= enough and not np.ptp(forces, axis=0).any():
        listed = ", ".join(f"{force:.4g}" for force in forces[0])
        yield probe.finding(
            f"all three forces are constant ({listed} N) over {len(forces)} samples, without any"
            " noise; is the sensor connected, and are these its live registers?",
        )
