"""The columns of a ``recording/1``, with their values in a row of the machine."""

from collections.abc import Callable

from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.row import Row
from pipelines.contracts.joints import Joint
from pipelines.mechanics.motion import CUFFS

Columns = dict[str, Callable[[Row], float]]


def columns_of(machine: Machine) -> Columns:
    """Return the recording's columns except time, each with its value as a function of a row."""
    columns: Columns = {}
    for j, drive in enumerate(machine.drives):
        joint = Joint(drive.settings.joint)
        for quantity in ("angle", "torque", "reference", "velocity", "current", "temperature"):
            if quantity in drive.recorded:
                columns[joint.column(quantity)] = _of_drive(j, quantity)
    for sensor in machine.sensors:
        cuff = sensor.settings.cuff
        for i, axis in enumerate("xyz"):
            columns[f"{cuff}_force_{axis}_n"] = _of_cuff(CUFFS.index(cuff), i)
    # The first drive's, whose clock and counter are the machine's.
    columns["sequence"] = lambda row: row.drives[0].sequence
    return columns


def _of_drive(j: int, quantity: str) -> Callable[[Row], float]:
    return lambda row: getattr(row.drives[j], quantity)


def _of_cuff(cuff: int, axis: int) -> Callable[[Row], float]:
    return lambda row: row.forces[cuff, axis]
