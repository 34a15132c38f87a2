"""Logs of LabVIEW in .tdms."""

import logging
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.flatten import clocks_of
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings


def open_tdms(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a .tdms file: a column ``group/channel`` for each channel.

    A waveform has its clock in its properties; its column is ``group/time``, in seconds.

    Raises
    ------
    InputError
        If it is damaged.
    """
    nptdms = library("nptdms")
    columns: Columns = {}
    units: dict[str, str] = {}
    clocks: dict[str, str] = {}
    warnings: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: warnings.append(record.getMessage())  # type: ignore[method-assign]
    # The library logs to the terminal that a file was cut.
    nptdms.log.log_manager.console_handler.setLevel(logging.CRITICAL)
    logging.getLogger("nptdms").addHandler(handler)
    try:
        with nptdms.TdmsFile.open(path) as file:
            for group in file.groups():
                if settings.table in (None, group.name):
                    for channel in group.channels():
                        _add(channel, group.name, columns, units, clocks)
    except Exception as error:  # the library raises errors of any class for a damaged file
        raise InputError(f"is a damaged .tdms file ({error}); copy it again") from error
    finally:
        logging.getLogger("nptdms").removeHandler(handler)
    if warnings and not columns:
        raise InputError(f"is a damaged .tdms file ({warnings[0]}); copy it again")
    clocks = clocks_of(columns, "/") | clocks
    return Source.in_memory(
        path, "TDMS", columns, units=units, clocks=clocks, remarks=tuple(warnings)
    )


def _add(
    channel: Any, group: str, columns: Columns, units: dict[str, str], clocks: dict[str, str]
) -> None:
    values = channel[:]
    if values.dtype.kind not in "biufMUSO" or not len(values):
        return
    name = f"{group}/{channel.name}"
    columns[name] = values
    if channel.properties.get("unit_string"):
        units[name] = str(channel.properties["unit_string"])
    if "wf_increment" not in channel.properties or not channel.properties["wf_increment"]:
        return
    time = channel.time_track()
    # One clock for all channels that share it.
    clock = f"{group}/time"
    if clock in columns and not np.array_equal(columns[clock], time):
        clock = f"{name}.time"
    columns[clock] = time
    units[clock], clocks[name] = "s", clock
