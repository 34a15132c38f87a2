"""How what was measured is shown, and beside it what was asked for."""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

CONSOLE = Console(width=120)


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    value: str
    ratio: float | None = None
    """How many times faster exoid is than what the line names."""
    wanted: str = ""
    """What docs/benchmarks.md asks for."""


def show(title: str, rows: Iterable[Row]) -> None:
    """Print a table, and how busy the machine was: what is measured beside other work is no
    measurement."""
    table = Table(box=None, pad_edge=False, title_justify="left", title_style="bold", title=title)
    for heading in ("", "measured", "ratio", "asked for"):
        table.add_column(heading, justify="right" if heading == "ratio" else "left")
    before = os.getloadavg()[0]
    try:
        for row in rows:
            table.add_row(row.name, row.value, f"{row.ratio:.1f}" if row.ratio else "", row.wanted)
    finally:  # some of it took long
        CONSOLE.print(table)
    CONSOLE.print(
        f"load {before:.1f} before, {os.getloadavg()[0]:.1f} after, of {os.cpu_count()} cores\n"
    )
