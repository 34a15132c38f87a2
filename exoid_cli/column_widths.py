"""How wide the columns of a table are where it must be broken: between words, and in a path after a
slash."""

import re
from collections.abc import Sequence

from rich.cells import cell_len

BETWEEN = 2
"""Spaces from one column to the next."""


def columns(headings: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[int | None]:
    """Return how wide each column is to be; None where all fit, and where not even the longest
    words do."""
    table = [[heading, *cells] for heading, *cells in zip(headings, *rows, strict=True)]
    wanted = [
        max(cell_len(line) for text in column for line in text.split("\n")) for column in table
    ]
    widths = [
        max(cell_len(piece) for text in column for piece in _pieces(text)) for column in table
    ]
    room = width - BETWEEN * (len(table) - 1)
    if sum(wanted) <= room or sum(widths) > room:
        return [None] * len(table)
    for _ in range(room - sum(widths)):
        # The narrowest of those that want more: what is long is long anyway.
        _, at = min((have, k) for k, have in enumerate(widths) if have < wanted[k])
        widths[at] += 1
    return list(widths)


def at_slashes(text: str, width: int) -> str:
    """Return a text with every path that is longer than a line broken after the last slash that
    fits."""
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
