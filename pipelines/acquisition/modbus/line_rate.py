"""The highest sample rate that the lines can carry, by the time that each character takes."""

from collections import defaultdict
from collections.abc import Mapping
from math import floor

from pipelines.acquisition.pacing import SLOW
from pipelines.errors import SettingsError
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.line import LineSettings
from pipelines.settings.rig.register_map import DriveMap, SensorMap


def refuse_slow_lines(rig: RigSettings, sample_rate_hz: float, *, with_sensors: bool) -> None:
    """Refuse a sample rate that is too high for the lines even if devices answer at once.

    Raises
    ------
    SettingsError
        Names the slowest line and the highest rate.
    """
    highest, slowest = highest_rate(rig, with_sensors=with_sensors)
    if slowest is not None and sample_rate_hz > highest:
        raise SettingsError(
            f"line {slowest} ({rig.line[slowest].place}): {sample_rate_hz:g} samples a second are"
            f" asked for, at most {floor(highest)} fit through; raise baud_rate, give devices lines"
            " of their own, or lower acquire.sample_rate_hz"
        )


def highest_rate(rig: RigSettings, *, with_sensors: bool) -> tuple[float, str | None]:
    """Return the highest sample rate of a rig's lines.

    A cycle reads the first drive's counter, exchanges with all drives, then reads the sensors that
    are due and drains drives that record themselves. Lines work concurrently, devices on one line
    take turns.

    Parameters
    ----------
    rig : RigSettings
        Devices and lines.
    with_sensors : bool
        Whether force sensors are read.

    Returns
    -------
    tuple
        Rate, Hz, and name of the line that limits it; infinity and None where no line's speed is
        known.
    """
    first = rig.drive[0]
    look = rig.line_of(first).exchange_s(
        _read_characters(rig.map.drive[first.map].read.sequence.registers)
    )
    drives, drains, records = (defaultdict[str | None, float](float) for _ in range(3))
    for drive in rig.drive:
        drives[drive.line] += rig.line_of(drive).exchange_s(
            _exchange_characters(rig.map.drive[drive.map])
        )
        if rig.sampling == "recorder":
            assert rig.record_rate_hz  # the rig file is checked: recorders have a rate
            took_s, brings = drain(rig.line_of(drive), rig.map.drive[drive.map])
            drains[drive.line] += took_s
            records[drive.line] += took_s / brings * rig.record_rate_hz
    sensors = _sensors_s(rig) if with_sensors else {}
    cycle = look + max(drives.values()) + max(sensors.values(), default=0.0)
    # Drains take this part of a line's time, whatever the rate of cycles is.
    share = 1.0 - max(records.values(), default=0.0)
    # A drain may fall into a single cycle, and must not delay its set-points.
    longest = max(
        cycle + max(drains.values(), default=0.0),
        cycle / share if share > 0.0 else float("inf"),
        # PhaseLock cannot use an answer that is later than this share of a sample.
        look / SLOW,
    )
    busy = {
        name: sum(step.get(name, 0.0) for step in (drives, sensors, drains)) for name in rig.line
    }
    slowest = max(busy, key=lambda name: busy[name], default=None)
    return (1.0 / longest, slowest) if longest else (float("inf"), None)


def _sensors_s(rig: RigSettings) -> Mapping[str | None, float]:
    """Return each line's longest time for the sensors of one cycle, s.

    Sensors with equal ``every`` take turns; the longest turns of different ones coincide at times.
    """
    turns = defaultdict[tuple[str | None, int], defaultdict[int, float]](lambda: defaultdict(float))
    for sensor in rig.sensor:
        took_s = rig.line_of(sensor).exchange_s(
            _read_characters(_count(rig.map.sensor[sensor.map]))
        )
        turns[sensor.line, sensor.every][rig.turn_of(sensor)] += took_s
    longest = defaultdict[str | None, float](float)
    for (line, _), took in turns.items():
        longest[line] += max(took.values())
    return longest


def drain(line: LineSettings, registers: DriveMap) -> tuple[float, int]:
    """Return the effort of one full read of a drive's own record.

    Parameters
    ----------
    line : LineSettings
        The drive's line.
    registers : DriveMap
        With the ring of the drive.

    Returns
    -------
    tuple
        Time, s, and number of samples.
    """
    ring = registers.ring
    assert ring  # the rig file is checked: with recorders, every drive has one
    brings = ring.records_per_read
    if ring.newest is None:
        return line.exchange_s(_queue_characters(brings * ring.words)), brings
    newest = line.exchange_s(_read_characters(ring.newest.registers))
    return line.exchange_s(_read_characters(brings * ring.words)) + newest, brings


def _exchange_characters(registers: DriveMap) -> int:
    """Return the characters of an FC23 exchange, request and reply as RTU frames."""
    # Request: unit, function, 4 addresses and counts of 2, byte count, CRC of 2. Reply: unit,
    # function, byte count, CRC.
    return 13 + 2 * Block(registers_of(registers.write)).count + 5 + 2 * _count(registers)


def _read_characters(registers: int) -> int:
    """Return the characters of an FC03 reading, request and reply as RTU frames."""
    # Request: unit, function, address, count, CRC. Reply: unit, function, byte count, CRC.
    return 8 + 5 + 2 * registers


def _queue_characters(registers: int) -> int:
    """Return the characters of an FC24 reading, request and reply as RTU frames."""
    # Request: unit, function, address, CRC. Reply: unit, function, two counts of 2, CRC.
    return 6 + 8 + 2 * registers


def _count(registers: DriveMap | SensorMap) -> int:
    return Block(registers_of(registers.read)).count
