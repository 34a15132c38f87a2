"""An event loop that keeps time to a fraction of a millisecond."""

import asyncio
import os
import selectors
import sys
from contextlib import suppress

MOST_FILES = 512
"""Most open files with which the exact loop is used, which supports 1024 at most."""


def exact_event_loop() -> asyncio.AbstractEventLoop:
    """Return an event loop with exact sleeps, where the system and its open files allow."""
    descriptor = os.open(os.devnull, os.O_RDONLY)  # the lowest free one
    os.close(descriptor)
    if sys.platform != "win32" and descriptor <= MOST_FILES:
        selector = selectors.SelectSelector()
        with suppress(OSError):  # where select supports only sockets
            selector.select(0.0)
            return asyncio.SelectorEventLoop(selector)
    return asyncio.new_event_loop()
