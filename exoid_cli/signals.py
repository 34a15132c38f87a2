"""Signals that ask exoid to end: the first one ends it, and none keeps from the user what is being
told already."""

import signal
import sys
from collections.abc import Iterator
from types import FrameType

from pipelines.errors import ExoidError
from pipelines.process.termination import ENDING, known, not_ignored


class Interrupted(KeyboardInterrupt):
    """A signal asked exoid to end.

    Python notes a KeyboardInterrupt proper that leaves ``exec``, as compilers and dataclasses use
    it, and under ``python -m`` dies of SIGINT in the end, whatever the exit code was to be.
    """


class Signals:
    """The signals of one process, whatever they come in the midst of."""

    def __init__(self) -> None:
        self.came: signal.Signals | None = None
        """The last one that asked exoid to end; compilers and imports take KeyboardInterrupt for
        their own failure."""
        self._heeded = list[signal.Signals]()

    def heed(self) -> None:
        """Raise KeyboardInterrupt at each from now on, so that what is half written is cleared
        away."""
        self._heeded = not_ignored(known(ENDING))
        for number in self._heeded:
            signal.signal(number, self._interrupt)
        sys.unraisablehook = _unraisable

    def ignore(self) -> None:
        """Let no signal change how exoid ends: all is told, its exit code is known."""
        # By the system: Python's own handlers are gone before its process is.
        for number in self._heeded:
            signal.signal(number, signal.SIG_IGN)

    def told(self) -> str:
        """Return in words what ended exoid."""
        return f"stopped by {ENDING[(self.came or signal.SIGINT).name]}"

    @property
    def exit_code(self) -> int:
        """As shells have it."""
        return 128 + (self.came or signal.SIGINT)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if not any(isinstance(error, ExoidError | KeyboardInterrupt) for error in _on_their_way()):
            self.came = signal.Signals(number)
            raise Interrupted


def _unraisable(told: "sys.UnraisableHookArgs") -> None:
    """Say nothing of an interruption that fell into a callback of compiled code, such as the
    compiler's."""
    if not issubclass(told.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(told)


def _on_their_way() -> Iterator[BaseException]:
    """Yield the exceptions in whose wake something is being cleared away or told just now."""
    error = sys.exception()
    while error:
        yield error
        error = error.__context__


signals = Signals()
