"""How often a line can carry what a cycle asks of it: a serial line takes its time for every character."""

from collections import defaultdict
from math import floor

from pipelines.acquisition.pace import SLOW
from pipelines.errors import SettingsError
from pipelines.registers import Block
from pipelines.settings.rig import DriveMap, RigSettings, SensorMap, registers_of


def refuse_slow_lines(rig: RigSettings, sample_rate_hz: float, *, with_sensors: bool) -> None:
    """Refuse a sample rate that the lines cannot keep up with even where devices answer at once.

    Raises
    ------
    SettingsError
        Tells the line that takes longest, and the highest rate.
    """
    highest, slowest = highest_rate(rig, with_sensors=with_sensors)
    if slowest is not None and sample_rate_hz > highest:
        raise SettingsError(
            f"line {slowest} ({rig.line[slowest].place}): {sample_rate_hz:g} samples a second are asked for, at most "
            f"{floor(highest)} fit through; raise baud_rate, give devices lines of their own, or lower "
            "acquire.sample_rate_hz"
        )


def highest_rate(rig: RigSettings, *, with_sensors: bool) -> tuple[float, str | None]:
    """Return the most samples a second, Hz, and the line that a sample waits for longest.

    A cycle looks at the first drive's counter, exchanges the drives, then reads the sensors. Lines work side by
    side, devices on one line take turns. Infinity and None where the speed of no line is known.
    """
    first = rig.drive[0]
    look = rig.line_of(first).exchange_s(read_characters(rig.map.drive[first.map].read.sequence.registers))
    drives, sensors = defaultdict[str | None, float](float), defaultdict[str | None, float](float)
    for drive in rig.drive:
        drives[drive.line] += rig.line_of(drive).exchange_s(exchange_characters(rig.map.drive[drive.map]))
    for sensor in rig.sensor if with_sensors else ():
        sensors[sensor.line] += rig.line_of(sensor).exchange_s(read_characters(_count(rig.map.sensor[sensor.map])))
    # An answer later than this share of a sample is too old to build on: see PhaseLock.
    longest = max(look + max(drives.values()) + max(sensors.values(), default=0.0), look / SLOW)
    busy = {name: drives.get(name, 0.0) + sensors.get(name, 0.0) for name in rig.line}
    slowest = max(busy, key=lambda name: busy[name], default=None)
    return (1.0 / longest, slowest) if longest else (float("inf"), None)


def exchange_characters(registers: DriveMap) -> int:
    """Return how many characters an FC23 exchange takes as RTU frames, request and reply together."""
    return 13 + 2 * Block(registers_of(registers.write)).count + 5 + 2 * _count(registers)


def read_characters(registers: int) -> int:
    """Return how many characters an FC03 reading takes as RTU frames, request and reply together."""
    return 8 + 5 + 2 * registers


def _count(registers: DriveMap | SensorMap) -> int:
    return Block(registers_of(registers.read)).count
