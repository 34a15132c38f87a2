"""The columns of a recording, each with the reading of the log that the map gives it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

from pipelines.errors import SettingsError
from pipelines.importing.quantities.conversion import columns_of
from pipelines.importing.sources.source import Source
from pipelines.settings import transmission
from pipelines.settings.import_map import ImportMap, ReadingSettings, TimeSettings

Reading = TypeVar("Reading", bound=ReadingSettings)


@dataclass(frozen=True)
class Channel:
    """One column of the recording, and the reading that it comes from."""

    target: str
    where: str
    """Its place in the map."""
    reading: ReadingSettings
    gain: float
    required: bool
    enabled: str | None = None
    """Column that is 0 where the reading is not valid."""
    time: str | None = None
    """Column of its clock, if that is not the clock of the log."""
    turns: bool = False
    """Whether it is the angle of a joint that turns without end."""


def channels_of(settings: ImportMap, source: Source) -> Iterator[Channel]:
    """Yield the channels of a map; the clocks that it leaves out are those of the file."""
    for i, joint in enumerate(settings.joint):
        for name, reading in joint.readings():
            gain = reading.gain(transmission.dimension_at(joint.kind, name))
            time = _clock(reading, f"joint[{i}].{name}", settings, source)
            yield Channel(
                joint.joint.column(name),
                f"joint[{i}].{name}",
                _with_clock(reading, time, settings),
                gain,
                # The equation of motion needs both; other channels may be blank in some rows.
                required=name in ("angle", "torque"),
                # While a drive is off only its torque is no measurement; the encoder still is one.
                enabled=joint.enabled if name == "torque" else None,
                time=time,
                turns=joint.turns and name in ("angle", "reference"),
            )
    for i, force in enumerate(settings.force):
        where = f"force[{i}]"
        clock_of = _clock(force, where, settings, source)
        force = _with_clock(force, clock_of, settings)
        yield Channel(force.target, where, force, 1.0, required=False, time=clock_of)


def _with_clock(reading: Reading, time: str | None, settings: ImportMap) -> Reading:
    """Return a reading with the unit and offset of its clock.

    The map may have them at another channel of that clock.
    """
    keys = ("time_unit", "time_scale", "time_offset_s")
    of_clock = (one for _, one in settings.readings() if one.time is not None and one.time == time)
    other = next((one for one in of_clock if one.model_fields_set & set(keys)), None)
    if other is None or reading.model_fields_set & set(keys):
        return reading
    return reading.model_copy(update={key: getattr(other, key) for key in keys})


def _clock(reading: ReadingSettings, where: str, settings: ImportMap, source: Source) -> str | None:
    """Return the clock of a reading: of the map, or else of the file, if it is not the log's."""
    if reading.time is not None or settings.time.column is None:
        return reading.time
    columns = (source.column_named(name) for name in columns_of(reading, where))
    own = {source.clocks.get(name) for name in columns} - {None}
    if len(own) > 1:
        names = ", ".join(sorted(map(str, own)))
        raise SettingsError(f"{where}.expression: mixes columns of the clocks {names}; use one")
    return next(iter(own - {settings.time.column}), None)


def needed_columns(channels: tuple[Channel, ...], time: TimeSettings) -> dict[str, str]:
    """Return every column that the map names, and its first place there."""
    needed = {time.column: "time.column"} if time.column is not None else {}
    if time.plus is not None:
        needed.setdefault(time.plus, "time.plus")
    for channel in channels:
        for name in columns_of(channel.reading, channel.where):
            needed.setdefault(name, channel.where)
        if channel.time is not None:
            needed.setdefault(channel.time, f"{channel.where}.time")
        if channel.enabled is not None:
            needed.setdefault(channel.enabled, f"{channel.where.rpartition('.')[0]}.enabled")
    return needed
