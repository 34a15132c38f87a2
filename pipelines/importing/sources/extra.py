"""Libraries that only some formats need."""

import importlib
from types import ModuleType

from pipelines.errors import InputError


def library(name: str) -> ModuleType:
    """Return a library of the extra ``import``; where it is not installed, say how to install it.

    Raises
    ------
    InputError
        Where it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise InputError(
            f"to read it exoid needs {package}, which is not installed; pip install 'exoid[import]'"
        ) from error
