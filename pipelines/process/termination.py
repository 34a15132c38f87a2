"""Signals that end exoid, and handlers in place of Python's."""

import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import FrameType

ENDING = {"SIGINT": "Ctrl-C", "SIGTERM": "SIGTERM", "SIGHUP": "SIGHUP", "SIGQUIT": "SIGQUIT"}
"""Signals that end exoid on systems that have them, with their names for users."""


def known(words: Mapping[str, str]) -> dict[signal.Signals, str]:
    """Return those signals that this system has (Windows: two), with their names for users."""
    return {
        signal.Signals[name]: word
        for name, word in words.items()
        if name in signal.Signals.__members__
    }


def not_ignored(numbers: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return the signals that are not ignored, as nohup or a shell's background may have them."""
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


@contextmanager
def handled(
    numbers: Iterable[signal.Signals], handle: Callable[[int, FrameType | None], None]
) -> Iterator[None]:
    """Handle signals for the duration of the block, then restore the handlers before it."""
    before = {}
    # Only the main thread can set handlers, and only it gets signals.
    with suppress(ValueError):
        for number in numbers:
            before[number] = signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
