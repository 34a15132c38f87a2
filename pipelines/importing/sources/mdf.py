"""Logs in ASAM MDF (.mdf, .mf4)."""

from pathlib import Path

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.source import Columns, Source, numbered_twins
from pipelines.settings.import_map import SourceSettings


def open_mdf(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a measurement file; each group of channels has a clock, in seconds.

    Raises
    ------
    InputError
        If it is damaged.
    """
    asammdf = library("asammdf", extra="mdf")
    channels, clock_of = [], {}
    try:
        with asammdf.MDF(path) as file:
            for group, content in enumerate(file.groups):
                master = file.masters_db.get(group)
                clock = len(channels)
                if master is not None:
                    stamps = file.get_master(group)
                    channels.append((content.channels[master].name, stamps, "s"))
                for index in range(len(content.channels)):
                    if index == master:
                        continue
                    signal = file.get(group=group, index=index)
                    if signal.samples.ndim == 1 and signal.samples.dtype.kind in "biufSU":
                        if master is not None:
                            clock_of[len(channels)] = clock
                        channels.append((signal.name, signal.samples, signal.unit))
    except Exception as error:  # the library raises errors of any class for a damaged file
        raise InputError(f"is a damaged MDF file ({error}); copy it again") from error
    names = numbered_twins([name for name, _, _ in channels])
    columns: Columns = {name: values for name, (_, values, _) in zip(names, channels, strict=True)}
    units = {name: unit for name, (_, _, unit) in zip(names, channels, strict=True) if unit}
    clocks = {names[channel]: names[clock] for channel, clock in clock_of.items()}
    return Source.in_memory(path, "MDF", columns, units=units, clocks=clocks)
