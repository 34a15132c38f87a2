"""Every error a user can cause or meet, grouped by who has to act.

Each text states the fault and its place, the expectation, and a remedy.
Only ``exoid_cli.app`` turns them into a line on the terminal and an exit code.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class ExoidError(Exception):
    """Root of the family; on its own, a fault of exoid itself."""

    exit_code = 1


class InputError(ExoidError):
    """The user's files, settings or arguments cannot be used as they are."""

    exit_code = 2


class ContractError(InputError):
    """A file does not keep its data contract."""


class SettingsError(InputError):
    """exoid.toml, a rig file or a command-line option asks for the impossible."""


class NotIdentifiable(InputError):
    """The motion cannot separate the parameters that were asked for."""


class DeviceError(ExoidError):
    """A drive, a sensor, the line to it, or a safety limit stopped the work."""

    exit_code = 3


class Refused(DeviceError):
    """A device refused a request, with a Modbus exception."""

    code = 0
    """Of the exception."""


class Unanswered(DeviceError):
    """A device gave no answer in time; a moving leg tolerates one."""


class Disconnected(DeviceError):
    """The other end refused the connection, or closed it."""


@contextmanager
def about(file: Path | str | None) -> Iterator[None]:
    """Begin every error of the block with the file that it is about, if any."""
    try:
        yield
    except ExoidError as error:
        raise type(error)(f"{file}: {error}" if file else str(error)) from error
