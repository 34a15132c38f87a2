"""Signals that ask exoid to end, and whoever hears them in Python's place."""

import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import FrameType

ENDING = {"SIGINT": "Ctrl-C", "SIGTERM": "SIGTERM", "SIGHUP": "SIGHUP", "SIGQUIT": "SIGQUIT"}
"""Signals that end exoid where the system has them, and what a user calls them."""


def known(words: Mapping[str, str]) -> dict[signal.Signals, str]:
    """Return those of some signals that this system has (Windows: two), and what a user calls
    them."""
    return {
        signal.Signals[name]: word
        for name, word in words.items()
        if name in signal.Signals.__members__
    }


def not_ignored(numbers: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return the signals that nohup or a shell's background does not have ignored: those stay
    so."""
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


@contextmanager
def handled(
    numbers: Iterable[signal.Signals], handle: Callable[[int, FrameType | None], None]
) -> Iterator[None]:
    """Let ``handle`` be told of signals for as long as a block lasts, and whoever was before it
    afterwards."""
    before = {}
    # Outside a process's main thread nobody can catch signals, and nobody is sent them.
    with suppress(ValueError):
        for number in numbers:
            before[number] = signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
