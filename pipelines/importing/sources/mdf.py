"""Logs in ASAM MDF (.mdf, .mf4)."""

import gc
import sys
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.source import Columns, Source, numbered_twins
from pipelines.settings.import_map import SourceSettings


@dataclass(frozen=True)
class _Channel:
    """A channel of the file, and the place of its clock in the list of channels."""

    name: str
    values: NDArray
    unit: str
    clock: int | None


def open_mdf(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a measurement file; each group of channels has a clock, in seconds.

    Raises
    ------
    InputError
        If it is damaged.
    """
    problem = ""
    # The library cannot clean up after a damaged file, and would print a traceback.
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        channels = _channels(path)
    except InputError:
        raise
    except Exception as error:  # the library raises errors of any class for a damaged file
        problem = str(error).partition("\n")[0]
    finally:
        gc.collect()
        sys.unraisablehook = hook
    if problem:
        raise InputError(f"is a damaged MDF file ({problem}); copy it again")
    names = numbered_twins([one.name for one in channels])
    named = list(zip(names, channels, strict=True))
    columns: Columns = {name: one.values for name, one in named}
    units = {name: one.unit for name, one in named if one.unit}
    clocks = {name: names[one.clock] for name, one in named if one.clock is not None}
    return Source.in_memory(path, "MDF", columns, units=units, clocks=clocks)


def _channels(path: Path) -> list[_Channel]:
    asammdf = library("asammdf", extra="mdf")
    channels: list[_Channel] = []
    with asammdf.MDF(path) as file:
        for group, content in enumerate(file.groups):
            master = file.masters_db.get(group)
            clock = None if master is None else len(channels)
            if master is not None:
                stamps = file.get_master(group)
                channels.append(_Channel(content.channels[master].name, stamps, "s", None))
            for index in (k for k in range(len(content.channels)) if k != master):
                signal = file.get(group=group, index=index)
                if signal.samples.ndim == 1 and signal.samples.dtype.kind in "biufSU":
                    one = _Channel(signal.name, signal.samples, signal.unit, clock)
                    channels.append(one)
    return channels
