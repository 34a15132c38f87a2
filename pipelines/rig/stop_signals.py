"""Signals that end a virtual rig.

They are noted, not raised as exceptions, which compiled code could swallow.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from pipelines.process.termination import ENDING, handled, known, not_ignored


@contextmanager
def set_on_signals(until: asyncio.Event) -> Iterator[list[int]]:
    """Set an event of the running loop at each ending signal; yield the list of those that came."""
    loop, came = asyncio.get_running_loop(), list[int]()

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)
        loop.call_soon_threadsafe(until.set)  # this wakes a loop that waits

    with handled(not_ignored(known(ENDING)), note):
        yield came
