"""Logs of NumPy (.npz, .npy)."""

from pathlib import Path

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
        arrays = {"array": content} if isinstance(content, np.ndarray) else dict(content)
    except Exception as error:  # the library raises errors of any class for a damaged file
        raise InputError(
            f"cannot be read as arrays of numbers ({error}); save plain arrays again"
        ) from error
    return nested_source(path, "NumPy", leaves_of(arrays))
