"""The table of docs/export.md: what each format holds of each effect.

``python -m pipelines.export.reference docs/export.md`` brings it up to date; a test says when it is
not.
"""

import re
import sys
from pathlib import Path

import numpy as np

from pipelines.effects import EFFECTS, Effect
from pipelines.export import FORMATS, Degree, Format
from pipelines.model import Term

BEGIN, END = "<!-- written by `make docs` -->", "<!-- until here -->"

COLUMNS = {"MJCF": "mjcf", "URDF": "urdf", "MATLAB and C": "c"}
"""JSON holds everything, and MATLAB and C hold the same."""


def table() -> str:
    """Return the table as Markdown, exoid's own effects only."""
    formats = {format.name: format for format in FORMATS}
    ours = [effect for effect in EFFECTS if effect.__module__.startswith("pipelines.effects.")]
    rows = [
        f"| [{effect.name}](effects/{effect.name}.md) | "
        + " | ".join(_cell(formats[name], _plausible(effect)) for name in COLUMNS.values())
        + " |"
        for effect in ours
    ]
    return "\n".join(
        [f"| effect | {' | '.join(COLUMNS)} |", "|---" * (1 + len(COLUMNS)) + "|", *rows]
    )


def _plausible(effect: type[Effect]) -> Term:
    """Return an effect in the middle of its typical range."""
    bound = effect(joint=None if effect.whole_leg else (effect.joints or ("hip",))[0])
    return Term(bound, bound.values_from(np.array([np.mean(p.typical) for p in bound.parameters])))


def _cell(format: Format, term: Term) -> str:
    holding = format.holding(term)
    return (
        f"– ({holding.how})"
        if holding.degree is Degree.NOT
        else f"**{holding.degree}**: {holding.how}"
    )


if __name__ == "__main__":
    page = Path(sys.argv[1])
    text = page.read_text(encoding="utf-8")
    between = re.compile(f"(?<={re.escape(BEGIN)}\n).*?(?={re.escape(END)})", re.DOTALL)
    page.write_text(between.sub(lambda old: f"\n{table()}\n\n", text), encoding="utf-8")
