"""Write the page docs/criteria.md: the numbers of the diagnosis, from the code itself.

``python -m pipelines.diagnosis.reference docs/criteria.md`` brings it up to date. Measurements of
the hyper-parameters (``make sensitivity``, ``make cross-validation``) are in
``criteria_measured.json`` in the same folder.
"""

import ast
import importlib
import inspect
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import fields
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any

from pipelines.diagnosis import criteria
from pipelines.diagnosis.criteria import CRITERIA, HELD, Criteria

MEASURED = Path(__file__).with_name("criteria_measured.json")
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


def numbers_of(folder: str) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Yield file, values by name and meaning of the numbers that a folder's files define.

    They are the constants of modules, whose meaning is empty where they have none, the defaults of
    fields and arguments, and the numbers of functions below a comment.
    """
    for path in sorted((Path(__file__).parent / folder).glob("*.py")):
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        module = importlib.import_module(f"{__package__}.{folder}.{path.stem}")
        for statement, meaning in _documented(tree.body):
            values = {
                name: value
                for name in _assigned(statement)
                if name.isupper() and _is_number(value := getattr(module, name))
            }
            if values:
                yield path.name, values, meaning
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                yield from ((path.name, *default) for default in _defaults(node))
        functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
        for function in sorted(functions, key=lambda node: node.lineno):
            for values, meaning in _default_arguments(function):
                yield path.name, values, meaning
            for values, meaning in _local_numbers(function, source.splitlines()):
                yield path.name, values, meaning


def _defaults(of: ast.ClassDef) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield value by name and meaning of the numbers that are defaults of a class."""
    for statement, meaning in _documented(of.body):
        if isinstance(statement, ast.AnnAssign) and statement.value and meaning:
            value = _constant(statement.value)
            # These stand for nothing, or for no change.
            if value not in (None, -1, 0, 1):
                yield dict.fromkeys(_assigned(statement), value), meaning


def _default_arguments(of: ast.FunctionDef) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield value by name and meaning of the numbers that are documented defaults of arguments."""
    named, documented = of.args.args, ast.get_docstring(of) or ""
    for argument, default in zip(
        named[len(named) - len(of.args.defaults) :], of.args.defaults, strict=True
    ):
        about = re.search(rf"^{argument.arg} : .*\n((?: {{4}}.*\n?)+)", documented, re.MULTILINE)
        value = _constant(default)
        if about and value not in (None, -1, 0, 1):
            yield {argument.arg: value}, " ".join(about[1].split())


def _local_numbers(
    function: ast.FunctionDef, lines: Sequence[str]
) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield values by name and the comment above, of numbers that a function assigns once."""
    statements = [
        node for node in ast.walk(function) if isinstance(node, ast.Assign | ast.AugAssign)
    ]
    changes = Counter(name for node in statements for name in _assigned(node))
    for node in sorted(statements, key=lambda node: node.lineno):
        names, value = _assigned(node), _constant(node.value)
        comment = _comment_above(node.lineno, lines)
        if names and comment and value is not None and all(changes[name] == 1 for name in names):
            values = value if isinstance(value, tuple) and len(names) > 1 else (value,)
            yield dict(zip(names, values, strict=True)), comment


def _constant(value: ast.expr) -> Any:
    """Return the numbers that an expression states, or its source if NumPy computes with them.

    It is None for another expression.
    """
    parts = list(ast.walk(value))
    numbers = [node.value for node in parts if isinstance(node, ast.Constant)]
    if not numbers or not all(map(_is_number, numbers)):
        return None
    if any(isinstance(node, ast.Name) and node.id not in ("np", "float") for node in parts):
        return None
    try:
        return ast.literal_eval(value)
    except ValueError:
        return ast.unparse(value)


def _comment_above(line: int, lines: Sequence[str]) -> str:
    """Return the comment that ends above a line, counted from 1."""
    above = list(
        takewhile(lambda text: text.startswith("#"), map(str.strip, lines[line - 2 :: -1]))
    )
    return " ".join(text.lstrip("# ") for text in reversed(above))


def _assigned(statement: ast.stmt) -> list[str]:
    """Return the names that a statement assigns."""
    if not isinstance(statement, ast.Assign | ast.AnnAssign | ast.AugAssign):
        return []
    names = (node for node in ast.walk(statement) if isinstance(node, ast.Name))
    return [node.id for node in names if isinstance(node.ctx, ast.Store)]


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
    table = _table(["name", "value", "meaning"], rows)
    return "\n".join([_introduction(), table, *_measured(), *_others()])


def _introduction() -> str:
    return f"""\
# Criteria: the numbers of a diagnosis

For readers who want to know the reasons of a verdict, or who change the decision. `make docs`
writes this page from the code. The first table has the hyper-parameters of the decision, from
`pipelines/diagnosis/criteria.py`. `make learn` learns all of them except
{", ".join(f"`{name}`" for name in HELD)}. It maximises the log probability that the posterior gives
to the truth, over simulated sessions. They were learned from 335 sessions of seeds from 210000 on.
They were learned again from 177 sessions whose evidence was stored by revision 1b85b45 (`python -m
tests.campaigns.learn fit --most 60`). The mean log probability of the truth was then -1.29 instead
of -1.48 in these sessions, and -1.56 instead of -1.57 in 356 others. So their values were kept. But
`cause` is lower by ln(3/2): a cause chooses among two prior sizes now, and chose among three
before. `look_alike` was learned from the 97 causes that were named in 155 sessions of seeds from
505000 and 508000 on. On these same causes it raises the mean log probability of the truth from
-0.54 to -0.20, and lowers the Brier score from 0.079 to 0.060.

[science.md](science.md#9-the-decision) has their equations. The [other numbers](#other-numbers) of
a diagnosis are at the end: those of its noise model, its search and its checks of the data.
"""


def _others() -> Iterator[str]:
    """Yield the numbers other than the criteria, a section for each folder."""
    yield """\
## Other numbers

These are not learned. They concern physics, recording, numerical precision, or the length of
reports. Capitals are defined at the head of their file in `pipelines/diagnosis`, others where they
are used. Those of figures are not listed.
"""
    for folder, heading in HEADINGS.items():
        rows = [
            [
                f"`{file}`",
                ", ".join(f"`{name}`" for name in values),
                _written(tuple(values.values())),
                meaning,
            ]
            for file, values, meaning in numbers_of(folder)
        ]
        yield f"### {heading}\n\n{_table(['file', 'name', 'value', 'meaning'], rows)}"


def _written(value: Any) -> str:
    if isinstance(value, str):
        return f"`{value}`"
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
