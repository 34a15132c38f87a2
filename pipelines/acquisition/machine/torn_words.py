"""Rows with a long value whose words are of two samples.

A device that does not latch the words of a value together may send the high word of one sample
with the low word of the next. Where the low word has wrapped meanwhile, the value is wrong by one
of the high word, which is 65536 counts of a binary value, for that one row.
"""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from typing import Generic, TypeVar

Row = TypeVar("Row")

NEAR = 1.0 / 8.0
"""Largest change from row to row in a value of which such a leap is no accident, high words."""


def is_leap(change: float, within: float = NEAR) -> bool:
    """Return whether a change is that of a high word one too large or small.

    Parameters
    ----------
    change : float
        High words.
    within : float, optional
        Deviation that is allowed, high words.
    """
    return abs(abs(change) - 1.0) <= within


class TornRows(Generic[Row]):
    """Holds a row back while one of its values may be torn."""

    def __init__(self, columns: Sequence[int], high_words_per_unit: Sequence[float]) -> None:
        """Watch some values of a row, each an integer of several words.

        Parameters
        ----------
        columns : sequence of int
            Their indices in the values of a row.
        high_words_per_unit : sequence of float
            How many of its high word each has per SI unit.
        """
        self._columns, self._per_unit = tuple(columns), tuple(high_words_per_unit)
        # Changes of each value that must have been small: noise of a word's size is no tear.
        before = 10
        self._changes = [deque[float](maxlen=before) for _ in columns]
        self._last: tuple[int, tuple[float, ...]] | None = None
        self._held: list[tuple[Row, int, tuple[float, ...]]] = []
        self._first: list[tuple[Row, int, tuple[float, ...]]] | None = []
        """Rows of the beginning, until there are enough to judge them; then None."""
        self.torn = 0
        """Rows that were left out."""

    def take(self, row: Row, number: int, values: Sequence[float]) -> list[Row]:
        """Return the rows that are known to be whole by now, this one or those before it.

        A leap that lasts is one of the machine, as an encoder's new turn.

        Parameters
        ----------
        row : object
            What is returned once it is known to be whole.
        number : int
            Of its sample; some may be missing.
        values : sequence of float
            SI units.
        """
        most_held, at_first = 5, 5
        high_words = tuple(
            values[at] * each for at, each in zip(self._columns, self._per_unit, strict=True)
        )
        if self._first is not None and self._columns:
            self._first.append((row, number, high_words))
            return self._begin(self._first) if len(self._first) == at_first else []
        changes, near = self._changes_to(high_words), self._near(number)
        leaps = [is_leap(change, close) for change, close in zip(changes, near, strict=True)]
        if not self._held and not any(leaps):
            return self._release(row, number, high_words)
        is_back = all(abs(change) <= close for change, close in zip(changes, near, strict=True))
        if self._held and is_back:
            self.torn += len(self._held)
            self._held.clear()
            return self._release(row, number, high_words)
        self._held.append((row, number, high_words))
        if len(self._held) <= most_held and any(leaps):
            return []
        held, self._held = self._held, []
        return [one for each in held for one in self._release(*each)]

    def _begin(self, first: list[tuple[Row, int, tuple[float, ...]]]) -> list[Row]:
        """Return the first rows without those that lie a word off the most.

        One at the very beginning may be before an encoder's new turn as well. It is left out, too:
        a row less is better than a wrong one.
        """
        self._first = None
        middle = [
            median(values) for values in zip(*(high_words for *_, high_words in first), strict=True)
        ]
        whole = [
            one
            for one in first
            if not any(is_leap(x - m, 0.25) for x, m in zip(one[2], middle, strict=True))
        ]
        steps = [
            abs(b - a) for (*_, x), (*_, y) in pairwise(whole) for a, b in zip(x, y, strict=True)
        ]
        # Where values change by so much, being a word off is no sign of a tear.
        whole = whole if max(steps, default=0.0) <= NEAR else first
        self.torn += len(first) - len(whole)
        return [one for each in whole for one in self._release(*each)]

    def _changes_to(self, high_words: tuple[float, ...]) -> list[float]:
        last = high_words if self._last is None else self._last[1]
        return [now - before for now, before in zip(high_words, last, strict=True)]

    def _near(self, number: int) -> list[float]:
        """Return by how much each value may change up to a sample, high words; -1 if unknown."""
        # The motion may become faster; beyond a quarter of a word the two look alike.
        faster, least, most, enough = 4.0, 1.0 / 32.0, 0.25, 3
        passed = number - self._last[0] if self._last else 1
        return [
            min(max(faster * passed * max(before), least), most)
            if len(before) >= enough and max(before) <= NEAR
            else -1.0
            for before in self._changes
        ]

    def _release(self, row: Row, number: int, high_words: tuple[float, ...]) -> list[Row]:
        if self._last is not None:
            passed = max(1, number - self._last[0])
            for before, change in zip(self._changes, self._changes_to(high_words), strict=True):
                before.append(abs(change) / passed)
        self._last = number, high_words
        return [row]
