"""Signals that ask exoid to end: the first ends it, and none cuts an error message short."""

import signal
import sys
from collections.abc import Iterator
from types import FrameType

from pipelines.errors import ExoidError
from pipelines.process.termination import ENDING, known, not_ignored


class Interrupted(KeyboardInterrupt):
    """A signal asked exoid to end.

    A subclass: if a KeyboardInterrupt itself leaves ``exec``, which compilers and dataclasses use,
    Python notes that. Under ``python -m`` the process then dies of SIGINT, whatever its exit code.
    """


class Signals:
    """The signals of one process."""

    def __init__(self) -> None:
        self.last: signal.Signals | None = None
        """The last signal; compilers and imports take KeyboardInterrupt for their own failure."""
        self._handled = list[signal.Signals]()

    def handle(self) -> None:
        """Raise KeyboardInterrupt at each signal from now on, so that partial files are removed."""
        self._handled = not_ignored(known(ENDING))
        for number in self._handled:
            signal.signal(number, self._interrupt)
        sys.unraisablehook = _report_unraisable

    def ignore(self) -> None:
        """Ignore all signals: the exit code is decided and the message printed."""
        # SIG_IGN, because Python's own handlers are removed before its process ends.
        for number in self._handled:
            signal.signal(number, signal.SIG_IGN)

    def message(self) -> str:
        """Return the message that names the signal."""
        return f"stopped by {ENDING[(self.last or signal.SIGINT).name]}"

    @property
    def exit_code(self) -> int:
        """128 and the signal's number, as in shells."""
        return 128 + (self.last or signal.SIGINT)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        # An error on its way to the user must not be replaced by an interruption.
        if not any(isinstance(error, ExoidError | KeyboardInterrupt) for error in _handled_now()):
            self.last = signal.Signals(number)
            raise Interrupted


def _report_unraisable(unraisable: "sys.UnraisableHookArgs") -> None:
    """Report nothing of an interruption inside a callback of compiled code, as LLVM's."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)


def _handled_now() -> Iterator[BaseException]:
    """Yield the exceptions that are being handled, the innermost first."""
    error = sys.exception()
    while error:
        yield error
        error = error.__context__


signals = Signals()
