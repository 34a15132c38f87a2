"""The page docs/criteria.md: the hyper-parameters of the decision, written from ``criteria.py`` itself.

``python -m pipelines.diagnosis.reference docs/criteria.md`` brings it up to date; what was measured
with them (``make sensitivity``, ``make cross-validation``) stands in ``criteria_measured.json`` beside this file.
"""

import ast
import inspect
import json
import sys
from collections.abc import Sequence
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

from pipelines.diagnosis import criteria
from pipelines.diagnosis.criteria import CRITERIA, HELD, LEARNED, Criteria

MEASURED = Path(__file__).with_name("criteria_measured.json")
INTRODUCTION = f"""\
# Criteria: the hyper-parameters of the decision

For those who want to know why a verdict came out as it did, or who change the decision.
Written by `make docs` from `pipelines/diagnosis/criteria.py`. All but {", ".join(f"`{name}`" for name in HELD)}
are learned (`make learn`): they maximise the log probability that the posterior gives to the truth, over
simulated sessions. {LEARNED}
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
        [f"`{field.name}`", _written(getattr(CRITERIA, field.name)), told[field.name]] for field in fields(Criteria)
    ]
    return "\n".join([INTRODUCTION, _table(["name", "value", "meaning"], rows), *_measured()])


def _written(value: float | tuple[float, ...]) -> str:
    values = value if isinstance(value, tuple) else (value,)
    return ", ".join(f"{v:.3g}" for v in values)


def _measured() -> list[str]:
    """Return what was measured with the values, a section each."""
    measured = json.loads(MEASURED.read_text(encoding="utf-8"))
    return [f"## {title}\n\n{one['about']}\n\n{_table(one['columns'], one['rows'])}" for title, one in measured.items()]


def keep(title: str, measured: dict[str, Any]) -> None:
    """Write what was measured with the values as a section: ``about``, ``columns`` and ``rows``."""
    told = json.loads(MEASURED.read_text(encoding="utf-8")) | {title: measured}
    MEASURED.write_text(json.dumps(told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = [columns, ["---"] * len(columns)]
    return "".join(f"| {' | '.join(row)} |\n" for row in (*head, *rows))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference())
