"""Libraries that only some formats need."""

import importlib
from types import ModuleType

from pipelines.errors import InputError


def library(name: str) -> ModuleType:
    """Return a library of the extra ``import``.

    Raises
    ------
    InputError
        If it is not installed, with the command that installs it.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise InputError(
            f"needs {package}, which is not installed; pip install 'exoid[import]'"
        ) from error
