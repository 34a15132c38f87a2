"""Signals that end a virtual rig: noted, not raised, as an exception may fall into compiled code, which swallows it."""

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress

ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT")


@contextmanager
def ended_by_signals(until: asyncio.Event) -> Iterator[list[int]]:
    """Set an event of the running loop at each signal that asks for an end; yields those that came."""
    loop, came, before = asyncio.get_running_loop(), list[int](), {}

    def hear(number: int, frame: object) -> None:
        came.append(number)
        loop.call_soon_threadsafe(until.set)  # which wakes a loop that waits

    with suppress(ValueError):  # outside a process's main thread nobody can catch signals, and nobody is sent them
        for name in ENDING:
            if (known := getattr(signal, name, None)) and signal.getsignal(known) is not signal.SIG_IGN:
                before[known] = signal.signal(known, hear)
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
