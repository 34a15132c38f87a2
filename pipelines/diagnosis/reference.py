"""Write the page docs/criteria.md: the numbers of the diagnosis, from the code itself.

``python -m pipelines.diagnosis.reference docs/criteria.md`` brings it up to date. Measurements of
the hyper-parameters (``make sensitivity``, ``make cross-validation``) are in
``criteria_measured.json`` in the same folder.
"""

import ast
import importlib
import inspect
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

from pipelines.diagnosis import criteria
from pipelines.diagnosis.criteria import CRITERIA, HELD, LEARNED, Criteria

PACKAGE = Path(__file__).parent
MEASURED = PACKAGE / "criteria_measured.json"
INTRODUCTION = f"""\
# Criteria: the numbers of a diagnosis

For readers who want to know the reasons of a verdict, or who change the decision. `make docs`
writes this page from the code. The first table has the hyper-parameters of the decision, from
`pipelines/diagnosis/criteria.py`. `make learn` learns all of them except
{", ".join(f"`{name}`" for name in HELD)}. It maximises the log probability that the posterior gives
to the truth, over simulated sessions. {LEARNED}
[science.md](science.md#9-the-decision) has their equations. The [other numbers](#other-numbers) of
a diagnosis are at the end: those of its noise model, its search and its checks of the data.
"""
OTHERS = """\
## Other numbers

These are not learned. They concern physics, recording, numerical precision, or the length of
reports. Each is defined at the head of its file in `pipelines/diagnosis`. Those of figures are not
listed.
"""
HEADINGS = {
    "data_faults": "Faults of acquisition",
    "evidence": "Noise and evidence",
    "candidates": "Candidates and their shapes",
    "selection": "Selection",
    "fit": "Fit and validation",
    "dependence": "Dependence of the error",
    "detectability": "Detectability",
    "verdict": "Words of the verdict",
}
"""The heading of each folder's numbers; those of figures are left out."""


def meanings() -> dict[str, str]:
    """Return the sentence below each field of ``Criteria``."""
    tree = ast.parse(inspect.getsource(criteria))
    (body,) = (n.body for n in tree.body if isinstance(n, ast.ClassDef) and n.name == "Criteria")
    return {
        statement.target.id: meaning
        for statement, meaning in _documented(body)
        if meaning
        and isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
    }


def _documented(body: Sequence[ast.stmt]) -> Iterator[tuple[ast.stmt, str]]:
    """Yield each statement with the string below it, empty without one."""
    # The added statement gives the last one a successor.
    for statement, below in pairwise([*body, ast.Pass()]):
        meaning = below.value if isinstance(below, ast.Expr) else None
        yield (
            statement,
            " ".join(str(meaning.value).split()) if isinstance(meaning, ast.Constant) else "",
        )


def numbers_of(folder: Path) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Yield file, values by name and meaning of the numbers that a folder's files define.

    The meaning is empty where a number has none.
    """
    for path in sorted(folder.glob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        module = importlib.import_module(f"{__package__}.{folder.name}.{path.stem}")
        for statement, meaning in _documented(body):
            values = {
                name: value
                for name in _assigned(statement)
                if _is_number(value := getattr(module, name))
            }
            if values:
                yield path.name, values, meaning


def _assigned(statement: ast.stmt) -> list[str]:
    """Return the names of constants that a statement assigns."""
    if not isinstance(statement, ast.Assign | ast.AnnAssign):
        return []
    names = (node for node in ast.walk(statement) if isinstance(node, ast.Name))
    return [n.id for n in names if isinstance(n.ctx, ast.Store) and n.id.isupper()]


def _is_number(value: Any) -> bool:
    values = value if isinstance(value, tuple) else (value,)
    # In Python a bool is an int, and no number here.
    return bool(values) and all(
        isinstance(v, int | float) and not isinstance(v, bool) for v in values
    )


def reference() -> str:
    """Return the page as Markdown."""
    entries = meanings()
    rows = [
        [f"`{field.name}`", _written(getattr(CRITERIA, field.name)), entries[field.name]]
        for field in fields(Criteria)
    ]
    return "\n".join(
        [INTRODUCTION, _table(["name", "value", "meaning"], rows), *_measured(), OTHERS, *_others()]
    )


def _others() -> Iterator[str]:
    """Yield the numbers other than the criteria, a section for each folder."""
    for folder, heading in HEADINGS.items():
        rows = [
            [
                f"`{file}`",
                ", ".join(f"`{name}`" for name in values),
                _written(tuple(values.values())),
                meaning,
            ]
            for file, values, meaning in numbers_of(PACKAGE / folder)
        ]
        yield f"### {heading}\n\n{_table(['file', 'name', 'value', 'meaning'], rows)}"


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_written, value))
    short = f"{value:.4g}"
    return short if float(short) != 1.0 else f"{value:.14g}"  # 0.999999 must not read as one


def _measured() -> list[str]:
    """Return the measurements of the criteria, a section each."""
    measured = json.loads(MEASURED.read_text(encoding="utf-8"))
    return [
        f"## {title}\n\n{one['about']}\n\n{_table(one['columns'], one['rows'])}"
        for title, one in measured.items()
    ]


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = [columns, ["---"] * len(columns)]
    return "".join(f"| {' | '.join(row)} |\n" for row in (*head, *rows))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference())
