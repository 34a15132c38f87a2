"""The table of docs/export.md: how each format holds each effect.

``python docs/site/export_table.py`` updates it; a test fails if it is outdated.
"""

import re
from pathlib import Path

import numpy as np

from pipelines.effects import EFFECTS, Effect
from pipelines.export import FORMATS, Degree, ExportedModel, Format
from pipelines.model import Term

BEGIN, END = "<!-- written by `make docs` -->", "<!-- until here -->"

COLUMNS = {"MJCF": "mjcf", "URDF": "urdf", "MATLAB and C": "c"}
"""MATLAB and C hold the same terms, and JSON all of them."""


def table() -> str:
    """Return the table of exoid's own effects as Markdown."""
    formats = {format.name: format for format in FORMATS}
    own = [effect for effect in EFFECTS if effect.__module__.startswith("pipelines.effects.")]
    rows = [
        f"| [{effect.name}](effects/{effect.name}.md) | "
        + " | ".join(_cell(formats[name], _plausible(effect)) for name in COLUMNS.values())
        + " |"
        for effect in own
    ]
    return "\n".join(
        [f"| effect | {' | '.join(COLUMNS)} |", "|---" * (1 + len(COLUMNS)) + "|", *rows]
    )


def _plausible(effect: type[Effect]) -> Term:
    """Return an effect with values in the middle of their typical ranges."""
    bound = effect(joint=None if effect.whole_leg else (effect.joints or ("hip",))[0])
    # Holdings depend on values, such as negative friction, so typical ones are needed.
    return Term(bound, bound.values_from(np.array([np.mean(p.typical) for p in bound.parameters])))


def _cell(format: Format[ExportedModel], term: Term) -> str:
    holding = format.holding(term)
    if holding.degree is Degree.NOT:
        return f"– ({holding.how})"
    return f"**{holding.degree}**: {holding.how}"


if __name__ == "__main__":
    page = Path(__file__).parents[1] / "export.md"
    text = page.read_text(encoding="utf-8")
    between = re.compile(f"(?<={re.escape(BEGIN)}\n).*?(?={re.escape(END)})", re.DOTALL)
    page.write_text(between.sub(lambda old: f"\n{table()}\n\n", text), encoding="utf-8")
