"""Rows with a long value whose words are of two samples.

A device that does not latch the words of a value together may send the high word of one sample
with the low word of the next. Where the low word has wrapped meanwhile, the value is wrong by 65536
counts, for that one row.
"""

from collections import deque
from collections.abc import Sequence
from typing import Generic, TypeVar

Row = TypeVar("Row")

WORD = 65536
"""Counts that a wrong high word is worth."""
NEAR = WORD // 8
"""Largest change from row to row beside which such a leap is no accident, counts."""


def is_leap(change: float) -> bool:
    """Return whether a change (counts) is that of a high word one too large or small."""
    return abs(abs(change) - WORD) <= NEAR


class TornRows(Generic[Row]):
    """Holds a row back while one of its values may be torn."""

    def __init__(self, columns: Sequence[int], counts_per_unit: Sequence[float]) -> None:
        """Watch some values of a row, each an integer of several words.

        Parameters
        ----------
        columns : sequence of int
            Their indices in the values of a row.
        counts_per_unit : sequence of float
            Counts per SI unit of each.
        """
        self._columns, self._counts_per_unit = tuple(columns), tuple(counts_per_unit)
        # Changes of each value that must have been small: noise of this size is no tear.
        before = 10
        self._changes = [deque[float](maxlen=before) for _ in columns]
        self._last: tuple[float, ...] | None = None
        self._held: list[tuple[Row, tuple[float, ...]]] = []
        self.torn = 0
        """Rows that were left out."""

    def take(self, row: Row, values: Sequence[float]) -> list[Row]:
        """Return the rows that are known to be whole by now, this one or those before it.

        A leap that lasts is one of the machine, as an encoder's new turn.
        """
        most_held = 5
        counts = tuple(
            values[at] * each for at, each in zip(self._columns, self._counts_per_unit, strict=True)
        )
        changes = self._changes_to(counts)
        if not self._held:
            if not any(map(self._is_suspicious, range(len(changes)), changes)):
                return self._release(row, counts)
            self._held.append((row, counts))
            return []
        if all(abs(change) <= NEAR for change in changes):
            self.torn += len(self._held)
            self._held.clear()
            return self._release(row, counts)
        self._held.append((row, counts))
        if len(self._held) <= most_held and any(map(is_leap, changes)):
            return []
        held, self._held = self._held, []
        return [one for pair in held for one in self._release(*pair)]

    def _changes_to(self, counts: tuple[float, ...]) -> list[float]:
        last = counts if self._last is None else self._last
        return [now - before for now, before in zip(counts, last, strict=True)]

    def _is_suspicious(self, k: int, change: float) -> bool:
        before = self._changes[k]
        is_quiet = len(before) == before.maxlen and max(before) <= NEAR
        return is_quiet and is_leap(change)

    def _release(self, row: Row, counts: tuple[float, ...]) -> list[Row]:
        for before, change in zip(self._changes, self._changes_to(counts), strict=True):
            before.append(abs(change))
        self._last = counts
        return [row]
