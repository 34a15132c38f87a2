"""The examination's result: tables for a person, JSON and Markdown for the record."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from rich import box
from rich.console import Console
from rich.table import Table

from tests.blind.scoring import SILENT, Score
from tests.blind.statistics import Rate, brier, calibration_error, reliability

BINS = ((0.0, 0.03), (0.03, 0.06), (0.06, 0.12), (0.12, 1.0))
VISIBILITY = ((0.0, 0.1), (0.1, 0.2), (0.2, 0.5), (0.5, 1.0), (1.0, float("inf")))


@dataclass(frozen=True)
class Page:
    """One table."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


def pages(scores: Sequence[Score]) -> list[Page]:
    """Return all tables of an examination, those without rows left out."""
    singles = [s for s in scores if s.category == "single"]
    made = [
        _summary(scores),
        _rates("By cause and joint", singles, lambda s: _label(s.truth[0])),
        _rates("By magnitude (share of the joint's rms torque)", singles, _bin_of),
        _rates("By visibility (what the baseline cannot imitate, over the noise floor)", singles, _visibility_of),
        _rates("By functional form", singles, lambda s: f"{s.truth[0][0]}: {s.forms[0]}{' (own)' * s.own_form}"),
        _rates("By kinds of run", singles, lambda s: ", ".join(s.kinds)),
        _rates("Outside the catalogue", _of(scores, "outside"), lambda s: f"{s.forms[0]}"),
        _rates("Data faults", _of(scores, "fault"), lambda s: s.truth[0][0]),
        _misses(scores),
        _confusion(singles),
        _reliability(scores),
        _coverage(scores),
    ]
    return [page for page in made if page.rows]


def _of(scores: Iterable[Score], category: str) -> list[Score]:
    return [s for s in scores if s.category == category]


def _label(named: tuple[str, str | None]) -> str:
    return "@".join(part for part in named if part)


def _bin_of(s: Score) -> str:
    low, high = next(b for b in BINS if b[0] <= s.magnitude < b[1])
    return f"{100 * low:2.0f} to {100 * high:.0f} %"


def _visibility_of(s: Score) -> str:
    low, high = next(b for b in VISIBILITY if b[0] <= s.visibility < b[1])
    return f"{low:g} to {high:g}"


def _summary(scores: Sequence[Score]) -> Page:
    singles, outside = _of(scores, "single"), _of(scores, "outside")
    large = [s for s in singles if s.magnitude >= 0.12]
    other = [s for s in singles if not s.own_form]
    forecasts = [f for s in scores for f in s.probabilities]
    ratios = [r for s in scores if s.category in ("single", "pair", "none") for r in s.rmse_over_floor.values()]
    floors = [r for s in scores for r in s.floor_over_truth.values()]
    rows = [
        ("single: right cause and joint first", _right(singles), ">= 96 %"),
        ("the same above 12 %", _right(large), ">= 99 %"),
        ("the same, other form than the catalogue's", _right(other), ">= 94 %"),
        ("silent about what was too small to be seen", _share(s.unseen for s in singles), ""),
        ("pair: both named", _right(_of(scores, "pair")), ">= 85 %"),
        ("false alarms, nothing hidden", _wrong(_of(scores, "none")), "<= 1 %"),
        ("false alarms, small imperfections", _wrong(_of(scores, "imperfect")), "<= 5 %"),
        ("outside the catalogue: unknown_cause", _right(outside), ">= 80 %"),
        ("outside the catalogue: nothing_missing", _share(s.status == SILENT for s in outside), "<= 5 %"),
        ("data fault named", _right(_of(scores, "fault")), ""),
        ("refused or crashed", _share(s.status in ("refused", "crashed") for s in scores if s.category != "fault"),
         "0"),
        ("extended RMSE over true noise floor, median", _number(ratios), "<= 1.05"),
        ("estimated over true noise floor, median", _number(floors), ""),
        ("Brier score", _or_none(brier(forecasts)), "<= 0.05"),
        ("expected calibration error", _or_none(calibration_error(forecasts)), "<= 0.05"),
        ("95 % intervals that hold the truth", _share(c[2] for s in scores for c in s.covered), "90 to 98 %"),
        ("seconds a diagnosis, median", _number([s.seconds for s in scores]), "< 10"),
    ]  # fmt: skip
    return Page("Summary", ("measure", "result", "target"), rows)


def _right(scores: Iterable[Score]) -> str:
    return str(Rate.of(s.right for s in scores))


def _wrong(scores: Iterable[Score]) -> str:
    return str(Rate.of(not s.right for s in scores))


def _share(outcomes: Iterable[bool]) -> str:
    return str(Rate.of(outcomes))


def _number(values: Sequence[float]) -> str:
    return f"{median(values):.3f}" if values else "no cases"


def _or_none(value: float | None) -> str:
    return "no cases" if value is None else f"{value:.3f}"


def _rates(title: str, scores: Sequence[Score], key: Callable[[Score], str]) -> Page:
    rows = []
    for name in sorted({key(s) for s in scores}):
        chosen = [s for s in scores if key(s) == name]
        answers = Counter(_answer(s) for s in chosen if not s.right)
        rows.append((name, _right(chosen), ", ".join(f"{answer} {n}" for answer, n in answers.most_common())))
    return Page(title, ("", "right", "else"), rows)


def _answer(s: Score) -> str:
    return _label(s.named[0]) if s.named else s.status


def _misses(scores: Sequence[Score]) -> Page:
    """List wrong answers with their seeds, so that each can be looked at."""
    rows = [
        (
            str(s.seed),
            " + ".join(_label(t) for t in s.truth) or s.category,
            ", ".join(s.forms) if s.category in ("single", "pair", "outside") else "",
            f"{s.magnitude:.3f}" if s.magnitude else "",
            " + ".join(_label(n) for n in s.named) or s.status,
        )
        for s in sorted(scores, key=lambda s: s.seed)
        if not s.right
    ]
    return Page("Wrong answers", ("seed", "hidden", "form", "magnitude", "answer"), rows)


def _confusion(singles: Sequence[Score]) -> Page:
    """Count what was hidden (rows) against what was named first (columns, by the rows' numbers).

    A tie that counts as right stands on the diagonal; the right cause at the wrong joint under ``joint``.
    """
    effects = sorted({s.truth[0][0] for s in singles} | {s.named[0][0] for s in singles if s.named})
    others = sorted({s.status for s in singles if not s.named})
    counts = Counter((s.truth[0][0], _column(s)) for s in singles)
    columns = [*effects, "joint", *others]
    head = ("hidden", *(str(i + 1) for i in range(len(effects))), "joint", *others)
    rows = [
        (f"{i + 1} {effect}", *(str(counts[effect, c] or "") for c in columns))
        for i, effect in enumerate(effects)
        if any(counts[effect, c] for c in columns)
    ]
    return Page("Confusion: hidden against named first", head, rows)


def _column(s: Score) -> str:
    if not s.named:
        return s.status
    if s.right:
        return s.truth[0][0]
    return "joint" if s.named[0][0] == s.truth[0][0] else s.named[0][0]


def _reliability(scores: Sequence[Score]) -> Page:
    curve = reliability([f for s in scores for f in s.probabilities])
    rows = [(f"{b.low:.1f} to {b.high:.1f}", f"{b.mean:.3f}", str(b.happened)) for b in curve]
    return Page("Reliability of the probabilities", ("said", "mean", "was so"), rows)


def _coverage(scores: Sequence[Score]) -> Page:
    found = [c for s in scores for c in s.covered]
    names = sorted({c[:2] for c in found})
    rows = [(f"{e}: {p}", str(Rate.of(c[2] for c in found if c[:2] == (e, p)))) for e, p in names]
    return Page("Coverage of the parameters' 95 % intervals", ("parameter", "holds the truth"), rows)


def show(console: Console, scores: Sequence[Score]) -> None:
    """Print all tables."""
    for page in pages(scores):
        table = Table(*page.head, title=page.title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
        for row in page.rows:
            table.add_row(*row)
        console.print(table)


def write(folder: Path, scores: Sequence[Score], seeds: str) -> None:
    """Write ``report.json`` (every score) and ``report.md`` (the tables)."""
    folder.mkdir(parents=True, exist_ok=True)
    ordered = sorted(scores, key=lambda s: s.seed)
    record = {"seeds": seeds, "scores": [asdict(s) for s in ordered]}
    (folder / "report.json").write_text(json.dumps(record, indent=1))
    (folder / "report.md").write_text(_markdown(ordered, seeds))


def _markdown(scores: Sequence[Score], seeds: str) -> str:
    lines = ["# Blind examination", "", f"{len(scores)} cases, {seeds}. Rates with Wilson's 95 % interval.", ""]
    for page in pages(scores):
        lines += [f"## {page.title}", "", _row(page.head), _row("---" for _ in page.head)]
        lines += [*(_row(row) for row in page.rows), ""]
    return "\n".join(lines)


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"
