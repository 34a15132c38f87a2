"""The page docs/criteria.md: the hyper-parameters of the decision, written from ``criteria.py`` itself.

``python -m pipelines.diagnosis.reference docs/criteria.md`` brings it up to date; what was measured
with them (``make sensitivity``) stands in ``criteria_measured.json`` beside this file.
"""

import ast
import inspect
import json
import sys
from dataclasses import fields
from itertools import pairwise
from pathlib import Path

from pipelines.diagnosis import criteria
from pipelines.diagnosis.criteria import CRITERIA, HELD, Criteria

MEASURED = Path(__file__).with_name("criteria_measured.json")
INTRODUCTION = f"""\
# Criteria: the hyper-parameters of the decision

For those who want to know why a verdict came out as it did, or who change the decision.
Written by `make docs` from `pipelines/diagnosis/criteria.py`. All but {", ".join(f"`{name}`" for name in HELD)}
are learned (`make learn`): they maximise the log probability that the posterior gives to the truth, over
simulated sessions.
[science.md](science.md#9-the-decision) has the equations in which they stand.
"""


def meanings() -> dict[str, str]:
    """Return the sentence below each field of ``Criteria``."""
    tree = ast.parse(inspect.getsource(criteria))
    (body,) = (n.body for n in tree.body if isinstance(n, ast.ClassDef) and n.name == "Criteria")
    found = {}
    for field, below in pairwise(body):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr):
            assert isinstance(field.target, ast.Name) and isinstance(below.value, ast.Constant)
            found[field.target.id] = " ".join(str(below.value.value).split())
    return found


def reference() -> str:
    """Return the page as Markdown."""
    told = meanings()
    rows = [
        f"| `{field.name}` | {_written(getattr(CRITERIA, field.name))} | {told[field.name]} |"
        for field in fields(Criteria)
    ]
    table = "| name | value | meaning |\n|---|---|---|\n" + "\n".join(rows) + "\n"
    return "\n".join([INTRODUCTION, table, *_measured()])


def _written(value: float | tuple[float, ...]) -> str:
    values = value if isinstance(value, tuple) else (value,)
    return ", ".join(f"{v:.3g}" for v in values)


def _measured() -> list[str]:
    """Return what was measured with the values, if anything was."""
    if not MEASURED.exists():
        return []
    measured = json.loads(MEASURED.read_text())
    head = "| changed by 30 % | " + " | ".join(measured["columns"]) + " |\n"
    line = "|---" * (len(measured["columns"]) + 1) + "|\n"
    rows = "\n".join(f"| {row[0]} | " + " | ".join(row[1:]) + " |" for row in measured["rows"])
    return [f"## How much each matters\n\n{measured['about']}\n", head + line + rows + "\n"]


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference())
