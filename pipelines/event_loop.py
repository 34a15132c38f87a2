"""The event loop of whoever keeps time to a fraction of a millisecond."""

import asyncio
import selectors
import sys


def exact_event_loop() -> asyncio.AbstractEventLoop:
    """Return an event loop that wakes its sleepers when they are due; the usual one waits for whole milliseconds."""
    if sys.platform == "win32":  # another loop is the usual one there, which serial ports and pipes need
        return asyncio.new_event_loop()
    return asyncio.SelectorEventLoop(selectors.SelectSelector())
