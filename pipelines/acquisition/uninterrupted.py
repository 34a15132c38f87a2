"""Work that goes on to its end even if the program is asked to end: drives must be disabled."""

import asyncio
from collections.abc import Callable, Coroutine, Iterable

from pipelines.process.event_loop import exact_event_loop

Note = Callable[[BaseException], None]
"""Takes an error that asked the work to end."""


def run_to_its_end(run: Coroutine, note: Note) -> None:
    """Run a coroutine to its end in an event loop of its own, and raise its error.

    An exception that ends the loop itself, as KeyboardInterrupt does, is noted, and the loop goes
    on.
    """
    # How often the event loop may be ended from outside until a run is given up.
    most_ended = 1000
    with asyncio.Runner(loop_factory=exact_event_loop) as runner:
        loop = runner.get_loop()
        task = loop.create_task(run)
        for tries_left in reversed(range(most_ended)):
            try:
                return loop.run_until_complete(task)
            except BaseException as error:
                # A loop that ends each time will not disable a drive any more.
                if task.done() or not tries_left:
                    raise
                note(error)


async def outlive(tasks: Iterable[asyncio.Future], note: Note) -> None:
    """Wait until all tasks have ended; note each request to end this one meanwhile."""
    pending = set(tasks)
    while pending:
        try:
            _, pending = await asyncio.wait(pending)
        except BaseException as error:
            note(error)
