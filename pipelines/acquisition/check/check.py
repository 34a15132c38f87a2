"""The whole check of a rig file, from its devices' connections to what is wrong in words."""

import asyncio
import logging
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from pipelines.acquisition.check.look import RigReport, look
from pipelines.acquisition.embedded import embedded
from pipelines.acquisition.machine import Machine
from pipelines.acquisition.pace import urgent
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings, load_rig


def check_rig(
    path: Path, rate_hz: float | None = None, run: Literal["exo_alone", "with_human"] = "exo_alone"
) -> RigReport:
    """Ask every device of a rig, move nothing, and say what is wrong.

    Parameters
    ----------
    path : Path
        The rig's description. An embedded rig is started first.
    rate_hz : float, optional
        Samples a second that an experiment asks for; else a virtual rig's own, and of a real one what it has.
    run : str
        Whether somebody is in the machine: only an empty one shows its sensors' zeros.
    """
    rig = load_rig(path)
    if rate_hz is None and rig.plant:
        rate_hz = rig.plant.sample_rate_hz
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say
    settings = RunSettings(name="check", run=run, purpose="train")
    place = embedded(rig, path, settings, rate_hz) if rig.embedded and rate_hz else nullcontext(rig)
    with place as present, nullcontext() if rig.clock == "lockstep" else urgent():
        return asyncio.run(_check(present, rate_hz, alone=run == "exo_alone"))


async def _check(rig: RigSettings, rate_hz: float | None, *, alone: bool) -> RigReport:
    machine = Machine(rig, with_sensors=True)
    try:
        return await look(machine, rate_hz, alone=alone)
    finally:
        machine.close()
