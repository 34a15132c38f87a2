"""The examination's result: tables for a person, JSON and Markdown for the record."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from tests.campaigns.blind import tables
from tests.campaigns.blind.scoring import Score
from tests.campaigns.blind.tables import Page

TABLES = (
    tables.summary,
    tables.by_world,
    tables.by_cause,
    tables.by_magnitude,
    tables.by_visibility,
    tables.by_form,
    tables.by_machine,
    tables.by_kinds,
    tables.pairs,
    tables.alarms,
    tables.outside,
    tables.families,
    tables.faults,
    tables.misses,
    tables.confusion,
    tables.residuals,
    tables.probabilities,
    tables.coverage,
)


@dataclass(frozen=True)
class Examination:
    """What was asked for, and how each case came out."""

    command: str
    scores: list[Score]


def pages(scores: Sequence[Score]) -> list[Page]:
    """Return all tables of an examination, those without rows left out."""
    return [page for page in (table(scores) for table in TABLES) if page.rows]


def show(console: Console, scores: Sequence[Score]) -> None:
    """Print all tables."""
    for page in pages(scores):
        table = Table(
            *page.head,
            title=page.title,
            title_justify="left",
            box=box.SIMPLE_HEAD,
            padding=(0, 1, 0, 0),
        )
        for row in page.rows:
            table.add_row(*row)
        console.print(table)


def write(folder: Path, examination: Examination) -> None:
    """Write ``report.json`` (the command, every score) and ``report.md`` (the tables)."""
    folder.mkdir(parents=True, exist_ok=True)
    scores = sorted(examination.scores, key=lambda s: s.seed)
    record = {"command": examination.command, "scores": [asdict(s) for s in scores]}
    (folder / "report.json").write_text(json.dumps(record, indent=1))
    seeds = f"seeds {scores[0].seed} to {scores[-1].seed}"
    heading = f"`{examination.command}`: {len(scores)} cases, {seeds}."
    lines = ["# Blind examination", "", heading, "Rates with Wilson's 95 % interval.", ""]
    (folder / "report.md").write_text(
        "\n".join([*lines, *(titled(page) for page in pages(scores))])
    )


def read(path: Path) -> Examination:
    """Read ``report.json``."""
    record = json.loads(path.read_text())
    rows = [{name: _tuples(value) for name, value in row.items()} for row in record["scores"]]
    return Examination(record["command"], [Score(**row) for row in rows])


def markdown(page: Page) -> str:
    """Return a table as Markdown."""
    return "\n".join(
        [_row(page.head), _row("---" for _ in page.head), *(_row(row) for row in page.rows), ""]
    )


def titled(page: Page) -> str:
    """Return a table under its heading."""
    return f"## {page.title}\n\n{markdown(page)}"


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _tuples(value: Any) -> Any:
    """JSON has no tuples; scores have no lists."""
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value
