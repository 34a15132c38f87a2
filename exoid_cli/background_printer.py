"""Printing from a thread of its own: a slow or closed terminal must not delay a moving leg."""

import queue
import threading
from collections.abc import Callable
from contextlib import suppress


class BackgroundPrinter:
    """Print lines in order while the block runs, for as long as the output can be written."""

    def __init__(
        self, write: Callable[[str], None], *, waiting: int = 100, closing_s: float = 1.0
    ) -> None:
        """Prepare the thread.

        Parameters
        ----------
        write : callable
            Writes a line.
        waiting : int, optional
            Lines that may wait; further lines are dropped.
        closing_s : float, optional
            Longest time to wait for the last lines, s.
        """
        self._write, self._closing_s = write, closing_s
        self._queue = queue.Queue[str | None](waiting)
        self._thread = threading.Thread(target=self._run, name="printer", daemon=True)

    def __enter__(self) -> "BackgroundPrinter":
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        # None ends the thread; if the queue is full it is dropped, and the daemon thread dies at
        # exit.
        self.print(None)
        # Bounded, as a terminal stopped by Ctrl-S would never take the last lines.
        self._thread.join(self._closing_s)

    def print(self, text: str | None) -> None:
        """Queue a line, or drop it if the queue is full; never wait, never fail."""
        with suppress(queue.Full):
            self._queue.put_nowait(text)

    def _run(self) -> None:
        # The output was closed; rich raises SystemExit for a broken pipe.
        with suppress(OSError, SystemExit):
            for text in iter(self._queue.get, None):
                self._write(text)
