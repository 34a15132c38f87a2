"""How often a line can carry what a cycle asks of it: a serial line takes its time for every character."""

from collections import defaultdict
from math import floor

from pipelines.acquisition.pace import SLOW
from pipelines.errors import SettingsError
from pipelines.registers import Block
from pipelines.settings.rig import DriveMap, RigSettings, SensorMap, registers_of


def refuse_slow_lines(rig: RigSettings, sample_rate_hz: float, *, with_sensors: bool) -> None:
    """Refuse a sample rate that one of the lines cannot keep up with even where devices answer at once.

    Raises
    ------
    SettingsError
        Tells the line and its highest rate.
    """
    for name, highest in highest_rates(rig, with_sensors=with_sensors).items():
        if sample_rate_hz > highest:
            on_it = sum(device.line == name for device in (*rig.drive, *(rig.sensor if with_sensors else ())))
            raise SettingsError(
                f"line {name} ({rig.line[name].place}): {sample_rate_hz:g} samples a second are asked for, at most "
                f"{floor(highest)} fit through it with {on_it} device{'s' * (on_it > 1)} on it; raise baud_rate, give "
                "devices lines of their own, or lower acquire.sample_rate_hz"
            )


def highest_rates(rig: RigSettings, *, with_sensors: bool) -> dict[str, float]:
    """Return the most samples a second, Hz, by line; of a line whose speed is not known, infinity."""
    busy, look = defaultdict[str | None, float](float), defaultdict[str | None, float](float)
    for place, drive in enumerate(rig.drive):
        line, registers = rig.line_of(drive), rig.map.drive[drive.map]
        busy[drive.line] += line.exchange_s(exchange_characters(registers))
        if not place:  # the first drive's counter is looked at before every exchange
            look[drive.line] = line.exchange_s(read_characters(registers.read.sequence.registers))
    for sensor in rig.sensor if with_sensors else ():
        characters = read_characters(_count(rig.map.sensor[sensor.map]))
        busy[sensor.line] += rig.line_of(sensor).exchange_s(characters) / sensor.every
    rates = {}
    for name in rig.line:
        # An answer later than this share of a sample is too old to build on: see PhaseLock.
        longest = max(busy[name] + look[name], look[name] / SLOW)
        rates[name] = 1.0 / longest if longest else float("inf")
    return rates


def exchange_characters(registers: DriveMap) -> int:
    """Return how many characters an FC23 exchange takes as RTU frames, request and reply together."""
    return 13 + 2 * Block(registers_of(registers.write)).count + 5 + 2 * _count(registers)


def read_characters(registers: int) -> int:
    """Return how many characters an FC03 reading takes as RTU frames, request and reply together."""
    return 8 + 5 + 2 * registers


def _count(registers: DriveMap | SensorMap) -> int:
    return Block(registers_of(registers.read)).count
