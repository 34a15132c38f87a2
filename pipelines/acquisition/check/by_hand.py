"""A guided manual test: a person moves the leg and presses the cuffs, with the drives disabled."""

import asyncio
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.check.velocity import check_velocity
from pipelines.acquisition.check.zeros import AXES
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.drive_protocol import disable
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.register import DIMENSION, UNITS

PATIENCE_S = 20.0
"""Longest wait for each movement."""
LOOK_S = 0.005
"""Pause between two readings."""
STILL_S = 0.3
"""Time at rest after which a movement is over."""
SWING_RAD = (0.1, 1.0)
"""Credible angles of a movement of 10 to 40 degrees by hand."""
MOTIONS = {
    "hip": (
        ("keep the knee straight, swing the leg forward by 10 to 40 degrees and back"),
        1.0,
    ),
    "knee": (
        "hold the thigh still, bend the knee by 10 to 40 degrees and straighten it again",
        -1.0,
    ),
}
"""Instruction for each joint, and the sign of its angle: see docs/contracts.md."""


class Operator(Protocol):
    """The person at the leg."""

    async def ready(self, prompt: str) -> None:
        """Show an instruction; return when the person begins."""


async def by_hand(
    probes: Sequence[Probe], rig: RigSettings, rate_hz: float | None, operator: Operator
) -> list[Finding]:
    """Let a person move every joint and press every cuff; return the findings.

    Parameters
    ----------
    probes : sequence of Probe
        All devices, connected.
    rate_hz : float, optional
        Samples a second, in lockstep.
    """
    # Least force of a push, as a share of safety.cuff_force_n.
    push_share = 0.025
    drives, sensors = [p for p in probes if p.is_drive], [p for p in probes if not p.is_drive]
    await operator.ready(
        "Hold the leg: its drives stay disabled from now on. The machine must be empty."
    )
    for probe in probes:
        await probe.read()
        if isinstance(probe.part, Drive):
            await disable(probe.part, probe.last()["angle"])
    findings: list[Finding] = []
    for probe in drives:
        motion, sign = MOTIONS[probe.place]
        await operator.ready(f"{probe.place}: {motion}.")
        # Half of the smallest swing counts, as nobody measures the degrees.
        moved = await _watch(drives, lambda p: np.array([p.last()["angle"]]), SWING_RAD[0] / 2)
        findings += _check_motion(probe, sign, moved, rate_hz)
    for probe in sensors:
        front = probe.place.endswith("front")
        inside = "forward" if front else "backward"
        await operator.ready(
            f"{probe.place}: press on the inside of this cuff, {inside}, and let go."
        )
        least = push_share * rig.safety.cuff_force_n
        pressed = await _watch(
            sensors, lambda p: np.array([p.last()[axis] for axis in AXES]), least, also=drives
        )
        # The cuff pushes back: pressed forward, its force on the leg is backward, and so negative.
        findings += _check_push(probe, -1.0 if front else 1.0, pressed, least)
    return findings


async def _watch(
    probes: Sequence[Probe],
    value: Callable[[Probe], NDArray],
    least: float,
    also: Sequence[Probe] = (),
) -> dict[Probe, Series]:
    """Read devices until a value has moved by ``least`` and come back, or for ``PATIENCE_S``.

    Return the answers of each probe. Those of ``also`` are only advanced, since in lockstep no
    device goes on without all drives.
    """
    # Largest distance from the start at rest, as a share of the movement.
    back = 0.3
    for probe in probes:
        await probe.step()
        # The latest answer shows where the movement begins. Those before it are no part of the
        # movement.
        probe.take()
    rest = np.concatenate([value(probe) for probe in probes])
    largest, still_since, began = np.zeros_like(rest), time.monotonic(), time.monotonic()
    while (now := time.monotonic()) - began < PATIENCE_S:
        await asyncio.gather(*(probe.step() for probe in (*probes, *also)))
        away = np.abs(np.concatenate([value(probe) for probe in probes]) - rest)
        # Not np.maximum: one NaN among the readings would hide all movements after it.
        largest = np.fmax(largest, away)
        which = int(np.argmax(np.nan_to_num(largest)))
        if largest[which] < least or not away[which] < back * largest[which]:
            still_since = now
        elif now - still_since > STILL_S:
            break
        await asyncio.sleep(LOOK_S)
    for probe in also:
        probe.take()
    return {probe: probe.take() for probe in probes}


def _peak(values: NDArray) -> float:
    """Return the largest deviation of values (n,) from the first one, with its sign."""
    away = values - values[0]
    return float(away[np.argmax(np.abs(away))])


def _check_motion(
    asked: Probe, sign: float, moved: dict[Probe, Series], rate_hz: float | None
) -> Iterator[Finding]:
    """Yield findings about the drive whose joint a person was asked to move."""
    # Least ratio of the movements of the intended channel and another.
    clear = 3.0
    # Movement below which an angle counts as constant.
    hardly_rad = 1e-4
    peaks = {probe: _peak(series.of("angle")) for probe, series in moved.items()}
    largest = max(peaks, key=lambda probe: abs(peaks[probe]))
    peak, where = peaks[asked], f"{asked.map_path}.read"
    if abs(peaks[largest]) < hardly_rad:
        yield asked.finding(
            f"no angle changed when the {asked.place} was to be moved; was it? Else the angle is"
            f" frozen: compare {where}.angle with the device's manual",
            "angle",
        )
        return
    if largest is not asked and abs(peaks[largest]) > clear * abs(peak):
        yield asked.finding(
            f"the {asked.place} was moved, but the angle of {largest.name} changed, by"
            f" {peaks[largest]:+.3g} rad, and not this one ({peak:+.3g}): the two are swapped;"
            " exchange host, port and unit of the two in the rig file",
            "angle",
        )
        return
    if peak * sign < 0:
        yield asked.finding(
            f"its angle went {'down' if peak < 0 else 'up'} ({peak:+.3g} rad) when the"
            f" {asked.place} went {'forward' if asked.place == 'hip' else 'into flexion'}; expected"
            f" {'up' if sign > 0 else 'down'}: change the sign of {where}.angle.scale, and of"
            f" velocity, current and write.reference{_shared(asked, moved)}",
            "angle",
        )
    if not SWING_RAD[0] / 2 <= abs(peak) <= 1.5 * SWING_RAD[1]:
        unit = asked.block.registers["angle"].unit
        plausible = [
            other
            for other in DIMENSION["angle"]
            if SWING_RAD[0] <= abs(peak) * UNITS[other] / UNITS[unit] <= SWING_RAD[1]
        ]
        remedy = "compare the manual with"
        if plausible:
            remedy = f'with unit = "{plausible[0]}" it would be plausible: correct'
        yield asked.finding(
            f"its angle changed by {peak:+.3g} rad in that motion, expected {SWING_RAD[0]:g} to"
            f" {SWING_RAD[1]:g} rad of 10 to 40 degrees; {remedy} {where}.angle",
            "angle",
        )
    yield from check_velocity(asked, moved[asked], rate_hz)


def _shared(asked: Probe, moved: dict[Probe, Series]) -> str:
    others = [
        probe.name for probe in moved if probe is not asked and probe.map_path == asked.map_path
    ]
    return f" (in a map of its own if {others[0]} is right)" if others else ""


def _check_push(
    asked: Probe, sign: float, pressed: dict[Probe, Series], least: float
) -> Iterator[Finding]:
    """Yield findings about the sensor whose cuff a person was asked to press."""
    peaks = {
        (probe, axis): _peak(series.of(axis)[series.fresh])
        for probe, series in pressed.items()
        for axis in AXES
    }
    (largest, axis), peak = max(peaks.items(), key=lambda item: abs(item[1]))
    where = f"{asked.map_path}.read"
    if abs(peak) < least:
        yield asked.finding(
            f"no force of any cuff changed by more than {abs(peak):.3g} N when {asked.place} was to"
            f" be pressed, expected {least:g} N; was it? Else compare scale and unit in {where}",
        )
    elif largest is not asked:
        yield asked.finding(
            f"{asked.place} was pressed, but {largest.name} measured it ({axis} {peak:+.3g} N): the"
            " two are swapped; exchange host, port and unit of the two in the rig file",
        )
    elif axis != "force_y":
        yield asked.finding(
            f"the push was measured in {axis} ({peak:+.3g} N), expected force_y, the segment's"
            f" forward axis: exchange the addresses in {where}",
            axis,
        )
    elif peak * sign < 0:
        yield asked.finding(
            f"force_y went {'up' if peak > 0 else 'down'} ({peak:+.3g} N), expected"
            f" {'up' if sign > 0 else 'down'}: it is the force of the exoskeleton on the leg,"
            f" forward positive; change the sign of {where}.force_y.scale",
            axis,
        )
