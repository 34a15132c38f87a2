"""Windows over a table that comes piece by piece, each with neighbouring rows on both sides."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import pyarrow as pa


class Window(NamedTuple):
    """Rows of a table: the core, and a margin before and after it."""

    rows: pa.Table
    first: int
    """Number of the first row in the whole table."""
    core: slice
    """The rows of the core within ``rows``."""

    def kept(self, table: pa.Table) -> pa.Table:
        """Return the core of a table that was computed from ``rows``, row by row."""
        return table.slice(self.core.start, self.core.stop - self.core.start)


def windows(pieces: Iterable[pa.Table], length: int, margin: int) -> Iterator[Window]:
    """Yield windows whose cores make up the whole table.

    Parameters
    ----------
    pieces : iterable of pyarrow.Table
        Rows in order.
    length : int
        Rows of a core; the last one has fewer.
    margin : int
        Rows on each side of a core, fewer only where the table begins or ends.

    Yields
    ------
    Window
        Core and margins.
    """
    held: pa.Table | None = None
    first = start = 0
    for piece in pieces:
        held = piece if held is None else pa.concat_tables([held, piece])
        # A core is complete only with the margin after it.
        while held.num_rows >= start + length + margin:
            rows = held.slice(0, start + length + margin)
            yield Window(rows, first, slice(start, start + length))
            # Rows before the margin of the next core are not needed any more.
            passed = max(0, start + length - margin)
            held, first, start = held.slice(passed), first + passed, start + length - passed
    if held is not None and held.num_rows > start:
        yield Window(held, first, slice(start, held.num_rows))
