"""Libraries that only some formats need."""

import importlib
from types import ModuleType

from pipelines.errors import InputError


def library(name: str, extra: str = "import") -> ModuleType:
    """Return a library of an extra.

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
            f"needs {package}, which is not installed; pip install 'exoid[{extra}]'"
        ) from error
