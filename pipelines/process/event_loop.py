"""The event loop of whoever keeps time to a fraction of a millisecond."""

import asyncio
import os
import selectors
import sys
from contextlib import suppress

MOST_FILES = 512
"""Open files up to which the exact loop is used: it serves 1024 at most."""


def exact_event_loop() -> asyncio.AbstractEventLoop:
    """Return an event loop that wakes its sleepers when they are due; the usual one waits for whole
    milliseconds.

    On Windows, and in a process with very many open files, it is the usual one all the same.
    """
    descriptor = os.open(os.devnull, os.O_RDONLY)  # the lowest that is free
    os.close(descriptor)
    if sys.platform != "win32" and descriptor <= MOST_FILES:
        selector = selectors.SelectSelector()
        with suppress(OSError):  # where nothing but sockets can be waited for
            selector.select(0.0)
            return asyncio.SelectorEventLoop(selector)
    return asyncio.new_event_loop()
