"""Signals that ask for a stop of the run, of which the control loop alone makes a stop."""

import asyncio
import signal
from collections.abc import Coroutine, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

from pipelines.errors import DeviceError
from pipelines.process.termination import ENDING, handled, known

T = TypeVar("T")


@contextmanager
def collected_signals() -> Iterator[list[str]]:
    """Collect the names of signals that ask for a stop, in place of their usual effect.

    The first of them has its usual effect at the end: no other run is to begin after it.
    """
    # A terminal that is closed must not leave a drive enabled either. Ctrl-Z would leave it to the
    # drives' own watchdogs to stop the leg.
    names = known({**ENDING, "SIGTSTP": "Ctrl-Z"})
    received, numbers = list[str](), list[signal.Signals]()

    def note(number: int, frame: FrameType | None) -> None:
        numbers.append(signal.Signals(number))
        received.append(names[numbers[-1]])

    with handled(names, note):
        yield received
    for number in numbers[:1]:
        signal.raise_signal(number)


async def until_signal(work: Coroutine[Any, Any, T], stopped_by: Sequence[str]) -> T:
    """Return the result of work that moves nothing.

    Raises
    ------
    DeviceError
        A signal came first, however long a device is awaited.
    """
    # Time between two looks for signals while devices are awaited, before anything moves.
    signal_poll_s = 0.05
    task = asyncio.ensure_future(work)
    try:
        while not task.done():
            await asyncio.wait([task], timeout=signal_poll_s)
            if stopped_by:
                raise DeviceError(
                    f"stopped by {stopped_by[0]} before the drives were enabled; nothing was moved"
                )
    except BaseException:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        raise
    return task.result()
