"""A null modem: two pseudo-terminals that stand for the two ends of a serial cable."""

import asyncio
import os
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def null_modem() -> Iterator[tuple[str, str]]:
    """Connect two serial ports for the duration of the block; yield their paths."""
    loop = asyncio.get_running_loop()
    pairs = [os.openpty(), os.openpty()]
    for (near, _), (far, _) in (pairs, pairs[::-1]):
        # A port that nobody reads fills up, and must not block the event loop of all lines.
        os.set_blocking(near, False)
        loop.add_reader(near, _pass_on, near, far)
    try:
        for _, port in pairs:
            tty.setraw(port)  # else it echoes bytes until a client sets it up
        # The ports stay open here too, so that a client can disconnect and connect again.
        yield os.ttyname(pairs[0][1]), os.ttyname(pairs[1][1])
    finally:
        for pair in pairs:
            loop.remove_reader(pair[0])
            for end in pair:
                os.close(end)


def _pass_on(near: int, far: int) -> None:
    # Bytes that are not read at the far end are lost, as on a cable.
    with suppress(BlockingIOError):
        os.write(far, os.read(near, 4096))
