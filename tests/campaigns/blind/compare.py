"""Two examinations of the same cases, compared by McNemar's test.

Run with ``python -m tests.campaigns.blind.compare OLD NEW``.

McNemar (1947), Psychometrika 12: only cases that one is right on and the other wrong count; were
both equally good, each such case would fall either way like a coin.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import comb
from pathlib import Path
from typing import Annotated

import typer

from tests.campaigns.blind.report import markdown, read
from tests.campaigns.blind.scoring import Score
from tests.campaigns.blind.statistics import brier, calibration_error
from tests.campaigns.blind.tables import Page, answer, hidden

Pair = tuple[Score, Score]
MOST_LISTED = 40


@dataclass(frozen=True)
class Changes:
    """How often both were right, and how often only one was."""

    both: int
    only_old: int
    only_new: int
    neither: int

    @classmethod
    def of(cls, pairs: Iterable[tuple[bool, bool]]) -> "Changes":
        """Count pairs of old and new."""
        counted = list(pairs)
        return cls(*(counted.count(one) for one in _OUTCOMES))

    @property
    def cases(self) -> int:
        """Return how many pairs there are."""
        return self.both + self.only_old + self.only_new + self.neither

    @property
    def p_value(self) -> float:
        """Return the two-sided probability of a difference as large as this, by chance alone."""
        n, fewer = self.only_old + self.only_new, min(self.only_old, self.only_new)
        return min(1.0, 2.0 * sum(comb(n, k) for k in range(fewer + 1)) / 2.0**n)


_OUTCOMES = ((True, True), (True, False), (False, True), (False, False))


def matched(old: Sequence[Score], new: Sequence[Score]) -> list[Pair]:
    """Return the cases that both examined: same seed, world and hidden effects."""
    known = {_key(s): s for s in old}
    return [(known[_key(s)], s) for s in new if _key(s) in known]


def _key(s: Score) -> tuple:
    return s.seed, s.world, s.machine, s.category, s.truth


def tables(pairs: Sequence[Pair]) -> list[Page]:
    """Return what became better and worse, by category, world and effect, and the changed cases."""
    head = ("", "cases", "old right", "new right", "only old", "only new", "p (McNemar)")
    pages = []
    for title, key in (
        ("By category", lambda s: s.category),
        ("By world", lambda s: s.world),
        ("By world and category", lambda s: f"{s.world} {s.category}"),
        ("By what is hidden", hidden),
    ):
        rows = [_row(name, chosen) for name, chosen in _grouped(pairs, key)]
        pages.append(Page(title, head, [_row("all", pairs), *rows]))
    return [*pages, _probabilities(pairs), _listed(pairs)]


def _grouped(pairs: Sequence[Pair], key: Callable[[Score], str]) -> list[tuple[str, list[Pair]]]:
    names = sorted({key(new) for _, new in pairs})
    return [(name, [pair for pair in pairs if key(pair[1]) == name]) for name in names]


def _row(name: str, pairs: Sequence[Pair]) -> tuple[str, ...]:
    c = Changes.of((old.right, new.right) for old, new in pairs)
    numbers = (c.cases, c.both + c.only_old, c.both + c.only_new, c.only_old, c.only_new)
    return (name, *map(str, numbers), f"{c.p_value:.3g}")


def _probabilities(pairs: Sequence[Pair]) -> Page:
    rows = []
    for name, scores in (("old", [p[0] for p in pairs]), ("new", [p[1] for p in pairs])):
        forecasts = [f for s in scores for f in s.probabilities]
        logs = [s.log_probability for s in scores if s.log_probability is not None]
        mean = sum(logs) / len(logs) if logs else None
        numbers = brier(forecasts), calibration_error(forecasts), mean
        shown = ("" if v is None else f"{v:.3f}" for v in numbers)
        rows.append((name, str(len(forecasts)), *shown))
    head = ("", "named causes", "Brier", "calibration error", "mean log probability of the truth")
    return Page("Probabilities", head, rows)


def _listed(pairs: Sequence[Pair]) -> Page:
    rows = [
        (str(new.seed), new.world, hidden(new), answer(old), answer(new), _better(new))
        for old, new in sorted(pairs, key=lambda pair: (pair[1].right, pair[1].seed))
        if old.right != new.right
    ]
    head = ("seed", "world", "hidden", "old answer", "new answer", "")
    return Page("Changed cases", head, rows[:MOST_LISTED])


def _better(new: Score) -> str:
    return "better" if new.right else "worse"


def main(
    old: Annotated[Path, typer.Argument(exists=True, help="report.json of the one.")],
    new: Annotated[Path, typer.Argument(exists=True, help="report.json of the other.")],
) -> None:
    """Compare two examinations case by case."""
    pairs = matched(read(old).scores, read(new).scores)
    if not pairs:
        raise typer.BadParameter("the reports have no case in common", param_hint="OLD NEW")
    for page in tables(pairs):
        typer.echo(f"## {page.title}\n\n{markdown(page)}")


if __name__ == "__main__":
    typer.run(main)
