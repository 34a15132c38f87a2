"""Lines said by a thread of their own: who reads them slowly, or not at all, does not hold up what
they tell of."""

import queue
import threading
from collections.abc import Callable
from contextlib import suppress

MOST_WAITING = 100
"""Lines that wait for a reader; what comes then is left out."""
CLOSING_S = 1.0
"""Longest wait for a reader at the end."""


class Aside:
    """Says lines in the order in which they come, for as long as a block lasts and anybody reads
    them."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._waiting = queue.Queue[str | None](MOST_WAITING)
        self._thread = threading.Thread(target=self._say_on, name="aside", daemon=True)

    def __enter__(self) -> "Aside":
        """Begin to say what comes."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._put(None)
        self._thread.join(CLOSING_S)

    def say(self, text: str) -> None:
        """Say a line soon, or leave it out; never waits, never fails."""
        self._put(text)

    def _put(self, text: str | None) -> None:
        with suppress(queue.Full):
            self._waiting.put_nowait(text)

    def _say_on(self) -> None:
        with suppress(OSError, SystemExit):  # nobody reads any more; rich ends a program then
            for text in iter(self._waiting.get, None):
                self._say(text)
