"""The page that reports the blind examination, written from its records.

``python -m tests.campaigns.blind.page REPORT... docs/blind.md`` writes the page and its
``images/blind-reliability.png``. The mixed examination comes first: its probabilities are those
drawn. ``docs/blind-machines.md`` is written from that of the machines of one joint. With
``--pooled`` the cases of all examinations are counted together: parts of one that was too long for
one day.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from tests.campaigns.blind import reliability_figure, tables
from tests.campaigns.blind.report import Examination, markdown, read, titled
from tests.campaigns.blind.scoring import Score
from tests.campaigns.blind.seeds import RANGES, uses
from tests.campaigns.blind.tables import Page
from tests.campaigns.blind.targets import measures, of

Table = Callable[[Sequence[Score]], Page]
OF_SINGLES: tuple[tuple[Table, str], ...] = (
    (tables.by_cause, "Silence about what `exoid detect` says cannot be seen counts as right."),
    (tables.by_magnitude, ""),
    (tables.by_visibility, "How much of an effect is there to be seen, whatever its size."),
    (tables.by_origin, "Whether the plant's equation is the catalogue's."),
    (tables.by_form, ""),
    (tables.by_machine, ""),
    (tables.by_kinds, ""),
    (
        tables.confusion,
        "Right answers, honest ties included, stand on the diagonal; the right cause at the wrong "
        "joint under *joint*.",
    ),
)
"""Tables of the examination with most single effects, each with the remark above it."""
OF_EACH: tuple[tuple[Table, str], ...] = (
    (tables.by_world, ""),
    (tables.pairs, ""),
    (tables.alarms, ""),
    (
        tables.outside,
        "Right is that something is missing, and that no cause of the catalogue is likely but one "
        "that a person would call it by.",
    ),
    (
        tables.families,
        "Right is a finding of an acceptable family, at the joint, with a probability of a half or "
        "more.",
    ),
    (tables.faults, "Right is file, joint and kind."),
    (tables.kinds_of_miss, "What was hidden, and what was answered, with the number of cases."),
    (tables.residuals, "Quantiles over sessions and joints."),
    (
        tables.probabilities,
        "Of every named cause, whether it or what it is tied with was there.\n\n"
        "![Stated probability against how often the cause was there]({picture})\n\n"
        "*Drawn from examination 1.*",
    ),
    (
        tables.coverage,
        "Of rightly named causes, parameters that the plant's form has in common with the "
        "catalogue's.",
    ),
    (
        tables.seconds,
        "Quantiles of wall time, on a machine with other work; `make bench` measures speed.",
    ),
)
"""Tables of every examination that has such cases; a remark may show the page's ``{picture}``."""

INTRODUCTION = """\
# How often a diagnosis is right

For everyone who asks how far to trust a verdict. Written by `make blind-page` from the records of
the blind examination;
[tests/campaigns/blind/README.md](../tests/campaigns/blind/README.md) explains what is hidden and
how answers are scored. The recordings come from simulators that share no code with exoid, and
`exoid diagnose` gets nothing else. Brackets hold Wilson's 95 % interval of a share.
"""
OF_ONE_JOINT = """\
These are machines of one joint, of sizes far from an exoskeleton's: a pendulum, a turntable, a
level slide and a lift. Each has one run of 60 to 80 s to train on and one to validate on.
"""


def page(
    parts_run: Sequence[Examination], picture: str = "", revision: str = "", *, pooled: bool = False
) -> str:
    """Return the page as Markdown.

    ``picture`` is where its figure lies beside it, ``revision`` that of the exoid that answered;
    ``pooled`` counts the cases of all examinations together.
    """
    examinations = [_pooled(parts_run)] if pooled else parts_run
    richest = max(examinations, key=lambda e: len(of(e.scores, "single")))
    legs = any(s.machine == "leg" for e in examinations for s in e.scores)
    parts = [
        INTRODUCTION,
        "" if legs else OF_ONE_JOINT,
        f"The answers are those of revision `{revision}`.\n" if revision else "",
        _what_was_run(parts_run, pooled),
        _targets(examinations),
    ]
    parts += [_section(table, remark, examinations, [richest]) for table, remark in OF_SINGLES]
    parts += [
        _section(table, remark.format(picture=picture), examinations, examinations)
        for table, remark in OF_EACH
    ]
    return "\n".join(part for part in parts if part)


def _section(
    table: Table, remark: str, every: Sequence[Examination], chosen: Sequence[Examination]
) -> str:
    """Return a table of each chosen examination under one heading; nothing where none has rows."""
    numbered = [(number, table(e.scores)) for number, e in enumerate(every, 1) if e in chosen]
    numbered = [(number, page) for number, page in numbered if page.rows]
    if not numbered:
        return ""
    lines = [f"## {numbered[0][1].title}", "", *([remark, ""] if remark else [])]
    for number, page in numbered:
        lines += [f"Examination {number}:", "", markdown(page)]
    return "\n".join(lines)


def _pooled(examinations: Sequence[Examination]) -> Examination:
    """Return one examination with the cases of several."""
    scores = [score for one in examinations for score in one.scores]
    if len({(s.seed, s.machine) for s in scores}) < len(scores):
        raise typer.BadParameter(
            "a seed is in two of these records, so its case would count twice: give each once"
        )
    return Examination("; ".join(one.command for one in examinations), scores)


def _what_was_run(examinations: Sequence[Examination], pooled: bool) -> str:
    rows = []
    for number, examination in enumerate(examinations, 1):
        seeds = [s.seed for s in examination.scores]
        rows.append(
            (
                str(number),
                f"`{examination.command}`",
                str(len(seeds)),
                f"{min(seeds)} to {max(seeds)}",
            )
        )
    section = Page("What was run", ("", "command", "cases", "seeds"), rows)
    together = "The tables count all these cases together, as examination 1.\n\n" * pooled
    uses_of_seeds = {use for e in examinations for use in uses(s.seed for s in e.scores)}
    return f"{titled(section)}\n{together}{_provenance(uses_of_seeds)}\n"


def _provenance(uses_of_seeds: set[str]) -> str:
    tuning, reporting = RANGES["tuning"], RANGES["reporting"]
    if uses_of_seeds == {"reporting"}:
        return (
            f"Seeds from {reporting.start} to {reporting.stop - 1} are for reporting: the "
            f"diagnosis was never tuned on them, only on seeds from {tuning.start} to "
            f"{tuning.stop - 1}."
        )
    span = f"{reporting.start} to {reporting.stop - 1}"
    return f"**Not a report: not all of these seeds are for reporting ({span}).**"


def _targets(examinations: Sequence[Examination]) -> str:
    columns = [measures(e.scores) for e in examinations]
    head = ["measure", "target"]
    for number in range(1, len(examinations) + 1):
        head += [f"examination {number}", "met"]
    rows = []
    for row in zip(*columns, strict=True):
        cells = [row[0].name, row[0].target]
        for m in row:
            cells += [m.shown, {True: "yes", False: "**no**", None: ""}[m.met]]
        rows.append(tuple(cells))
    note = "*Met* says whether the measured value itself, not its interval, is within the target.\n"
    return f"{titled(Page('Targets and measurements', tuple(head), rows))}\n{note}"


def main(
    records: Annotated[
        list[Path], typer.Argument(exists=True, help="report.json of one or more, and the page.")
    ],
    out: Annotated[Path, typer.Argument(help="The page to be written.")],
    revision: Annotated[
        str, typer.Option(help="Which revision of exoid gave the answers, where it is not this.")
    ] = "",
    pooled: Annotated[
        bool, typer.Option("--pooled", help="Count the cases of all records together.")
    ] = False,
) -> None:
    """Write the page and its picture."""
    examinations = [read(path) for path in records]
    picture = Path("images") / f"{out.stem}-reliability.png"
    (out.parent / picture).parent.mkdir(parents=True, exist_ok=True)
    drawn = _pooled(examinations) if pooled else examinations[0]
    reliability_figure.draw(drawn.scores, out.parent / picture)
    out.write_text(page(examinations, str(picture), revision, pooled=pooled))


if __name__ == "__main__":
    typer.run(main)
