"""Logs of NumPy (.npz, .npy)."""

from pathlib import Path
from typing import Any

import numpy as np

from pipelines.errors import InputError
from pipelines.importing.sources.flatten import leaves_of, nested_source
from pipelines.importing.sources.source import Source
from pipelines.settings.import_map import SourceSettings


def open_numpy(path: Path, settings: SourceSettings) -> Source:
    """Return the log in arrays of NumPy.

    Raises
    ------
    InputError
        If they are damaged, or hold Python objects, which could run a program.
    """
    try:
        content = np.load(path, allow_pickle=False)
        arrays, objects = _arrays(content)
    except Exception as error:  # the library raises errors of any class for a damaged file
        raise InputError(
            f"cannot be read as arrays of numbers ({error}); save plain arrays again"
        ) from error
    if objects and not arrays:
        raise InputError(
            f"holds Python objects in {', '.join(objects)}, which could run a program and are not"
            " read; save plain arrays of numbers, one for each signal"
        )
    notes = (f"Python objects left out: {', '.join(objects)}",) if objects else ()
    return nested_source(path, "NumPy", leaves_of(arrays), notes)


def _arrays(content: Any) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the plain arrays, and the names of those of Python objects, which are not loaded."""
    if isinstance(content, np.ndarray):
        return {"array": content}, []
    arrays: dict[str, np.ndarray] = {}
    objects: list[str] = []
    for name in content.files:
        # The archive leaves the ending out of its names.
        member = name if name in content.zip.namelist() else f"{name}.npy"
        with content.zip.open(member) as file:
            major, _ = np.lib.format.read_magic(file)
            # Version 3 differs from 2 in the encoding of field names only.
            if major == 1:
                _, _, dtype = np.lib.format.read_array_header_1_0(file)
            else:
                _, _, dtype = np.lib.format.read_array_header_2_0(file)
        if dtype.hasobject:
            objects.append(name)
        else:
            arrays[name] = content[name]
    return arrays, objects
