"""Widths of a table's columns where lines must be broken: between words, in paths after a slash."""

import re
from collections.abc import Sequence

from rich.cells import cell_len


def column_widths(
    headings: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> list[int | None]:
    """Return each column's width; None for all where no line needs or allows a break."""
    table = [[heading, *cells] for heading, *cells in zip(headings, *rows, strict=True)]
    wanted = [
        max(cell_len(line) for text in column for line in text.split("\n")) for column in table
    ]
    widths = [
        max(cell_len(piece) for text in column for piece in _pieces(text)) for column in table
    ]
    room = width - 2 * (len(table) - 1)  # two spaces between columns
    # Nothing to break, or even the shortest pieces do not fit.
    if sum(wanted) <= room or sum(widths) > room:
        return [None] * len(table)
    for _ in range(room - sum(widths)):
        # Widen the narrowest first: a long text needs several lines anyway.
        growing = [k for k, present in enumerate(widths) if present < wanted[k]]
        widths[min(growing, key=widths.__getitem__)] += 1
    return list(widths)


def break_at_slashes(text: str, width: int) -> str:
    """Break every path that is longer than a line after the last slash that fits."""
    return re.sub(r"\S+", lambda word: _broken(word[0], width), text)


def _pieces(text: str) -> list[str]:
    return re.findall(r"[^\s/]*/|[^\s/]+", text) or [""]


def _broken(word: str, width: int) -> str:
    lines = [""]
    for piece in _pieces(word):
        if lines[-1] and cell_len(lines[-1] + piece) > width:
            lines.append("")
        lines[-1] += piece
    return "\n".join(lines)
