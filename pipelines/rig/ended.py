"""Signals that end a virtual rig: noted, not raised, as an exception may fall into compiled code,
which swallows it."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from pipelines.process.termination import ENDING, handled, known, not_ignored


@contextmanager
def ended_by_signals(until: asyncio.Event) -> Iterator[list[int]]:
    """Set an event of the running loop at each signal that asks for an end; yields those that
    came."""
    loop, came = asyncio.get_running_loop(), list[int]()

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)
        loop.call_soon_threadsafe(until.set)  # which wakes a loop that waits

    with handled(not_ignored(known(ENDING)), note):
        yield came
