"""An event loop that keeps time to a fraction of a millisecond."""

import asyncio
import os
import selectors
import sys
from contextlib import suppress


def exact_event_loop() -> asyncio.AbstractEventLoop:
    """Return an event loop with exact sleeps, where the system and its open files allow."""
    # Most open files with which the exact loop is used, which supports 1024 at most.
    most_files = 512
    descriptor = os.open(os.devnull, os.O_RDONLY)  # the lowest free one
    os.close(descriptor)
    # asyncio's choice on Linux, epoll, rounds each sleep up to whole milliseconds. Select does not.
    if sys.platform != "win32" and descriptor <= most_files:
        selector = selectors.SelectSelector()
        with suppress(OSError):  # where select supports only sockets
            selector.select(0.0)
            return asyncio.SelectorEventLoop(selector)
    return asyncio.new_event_loop()
