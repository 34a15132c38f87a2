"""Logs in MATLAB's .mat files, v4 to v7.3."""

from pathlib import Path

import scipy.io

from pipelines.errors import InputError
from pipelines.importing.sources.flatten import leaves_of, nested_source, places_of
from pipelines.importing.sources.hdf5 import open_hdf5
from pipelines.importing.sources.source import Source
from pipelines.settings.import_map import SourceSettings
from pipelines.validation.suggestion import suggestion


def open_matlab(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a .mat file.

    Fields of a struct have dotted names, columns of a matrix numbered ones.

    Raises
    ------
    InputError
        If the file is damaged, or lacks the variable that the map names.
    """
    v73 = b"MATLAB 7.3"
    with open(path, "rb") as file:
        if file.read(len(v73)) == v73:
            return open_hdf5(path, settings, "MATLAB v7.3")
    try:
        content = scipy.io.loadmat(path, simplify_cells=True)
    except Exception as error:  # scipy raises errors of any class for a damaged file
        raise InputError(
            f"is a damaged .mat file ({type(error).__name__}: {error}); save it again"
        ) from error
    # Names with two underscores are scipy's own: header, version, globals.
    variables = {
        name: value
        for name, value in content.items()
        # Objects such as a timeseries are stored in a form that only MATLAB can read.
        if not name.startswith("__") and not isinstance(value, scipy.io.matlab.MatlabOpaque)
    }
    if settings.table is not None:
        if settings.table not in variables:
            raise InputError(
                f"has no variable {settings.table!r}, which source.table names; "
                f"{suggestion(settings.table, list(variables))}"
            )
        variables = variables[settings.table]
    aliases = places_of(variables)
    return nested_source(path, "MATLAB", leaves_of(variables), aliases=aliases)
