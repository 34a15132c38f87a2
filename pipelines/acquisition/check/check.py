"""The whole check of a rig file, from its devices' connections to what is wrong in words."""

import asyncio
import logging
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from pipelines.acquisition.check.by_hand import Operator, by_hand
from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.guided import guided, refuse_far_from_zero
from pipelines.acquisition.check.look import RigReport, look, probes_of
from pipelines.acquisition.machine.embedded_rig import embedded
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.modbus.exclusive_access import alone
from pipelines.acquisition.pacing import urgent
from pipelines.acquisition.preconditions.feasible_rate import refusals
from pipelines.acquisition.preconditions.human_interlock import refuse_seldom_read
from pipelines.acquisition.preconditions.set_point_scale import misplaced_set_points
from pipelines.errors import DeviceError, InputError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings, load_rig


def check_rig(
    path: Path,
    rate_hz: float | None = None,
    run: Literal["exo_alone", "with_human"] = "exo_alone",
    operator: Operator | None = None,
    *,
    move: bool = False,
) -> RigReport:
    """Ask every device of a rig and say what is wrong; move nothing unless asked to.

    Parameters
    ----------
    path : Path
        The rig's description. An embedded rig is started first.
    rate_hz : float, optional
        Samples a second that an experiment asks for; else a virtual rig's own, and of a real one
        what it has.
    run : str
        Whether somebody is in the machine: only an empty one shows its sensors' zeros.
    operator : Operator, optional
        Who moves the joints and presses the cuffs, if all devices answer.
    move : bool
        Whether the drives shall move the joints a little, once nothing else is wrong.

    Raises
    ------
    SettingsError
        Where no rate is told, and the rig records by itself.
    DeviceError
        Where another process holds one of the lines: nothing is connected then.
    """
    if run == "with_human":
        refuse_to_move_a_person(by_hand=operator is not None, move=move)
    rig = load_rig(path)
    if rate_hz is None and rig.plant:
        rate_hz = rig.plant.sample_rate_hz
    if move and rate_hz is None and rig.sampling == "recorder":
        raise SettingsError(
            "--rate-hz: missing; of a rig that records by itself it is not known how often it is"
            " told"
        )
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say
    settings = RunSettings(name="check", run=run, purpose="train")
    place = embedded(rig, path, settings, rate_hz) if rig.embedded and rate_hz else nullcontext(rig)
    with place as present, nullcontext() if rig.clock == "lockstep" else urgent():
        # Who only asks loads the devices too, and would judge what another run makes of them. The
        # movement holds the lines itself.
        with alone(present):
            report, start = asyncio.run(_check(present, rate_hz, run == "exo_alone", operator))
        if move and not report.findings:
            try:
                if not report.by_hand:
                    refuse_far_from_zero(start)
                report.answers, report.findings = guided(
                    present, start, rate_hz or _counted(report), run
                )
            except InputError as error:  # what was found out before must not be lost with it
                report.findings.append(Finding("rig", str(error)))
        return report


def refuse_to_move_a_person(*, by_hand: bool, move: bool) -> None:
    """Refuse to move a leg of unverified signs with somebody in it, or to take its torque away."""
    for option, given in (("--by-hand", by_hand), ("--move", move)):
        if given:
            raise InputError(
                f"{option} wants nobody in the machine, but --run with_human says that somebody is;"
                " drop one"
            )


def unfit(rig: RigSettings, rate_hz: float | None) -> Iterator[Finding]:
    """Yield why no run would begin with this rig file at a rate, whatever its devices answer."""
    if rate_hz is None or rig.clock == "lockstep":
        return
    for refuse in (*refusals(with_sensors=True), refuse_seldom_read):
        try:
            refuse(rig, rate_hz)
        except SettingsError as error:
            yield Finding("rig", str(error))


def _counted(report: RigReport) -> float:
    """Return the rate at which the first drive was found to sample."""
    clock = report.devices[0].clock
    assert clock and clock.counter_hz  # else there were findings
    return clock.counter_hz


async def _check(
    rig: RigSettings, rate_hz: float | None, alone: bool, operator: Operator | None
) -> tuple[RigReport, list[float]]:
    """Return what was found, and where the leg stands at the end of it, rad."""
    machine = Machine(rig, with_sensors=True)
    try:
        report = await look(machine, rate_hz, alone=alone)
        report.findings += unfit(rig, rate_hz)
        report.findings += [Finding("rig", why) for why in misplaced_set_points(rig)]
        if operator and all(device.latency for device in report.devices):
            report.by_hand = True
            try:
                await machine.refuse_driven()
                report.findings += await by_hand(probes_of(machine), rig, rate_hz, operator)
            except DeviceError as error:
                report.findings.append(Finding("rig", str(error)))
        return report, (
            [] if report.findings else [(await drive.look()).angle for drive in machine.drives]
        )
    finally:
        machine.close()
