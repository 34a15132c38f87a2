"""``exoid show``: describe a file by its contract, its origin and its content."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.contracts.inspection import Inspection


def show(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A Parquet or JSON file of exoid's, or a trajectory as TOML."
        ),
    ],
) -> None:
    """Say what an exoid file is, where it came from, and its columns with units and ranges.

    A model is shown by its parameters, a verdict by its findings, candidates
    by the reasons for and against each.

    \b
    Examples:
      exoid show recordings/with_human_train.parquet
      exoid show identified/parameters.parquet
      exoid show diagnosed/verdict.json
    """
    from pipelines.contracts.inspection import inspect

    inspection = inspect(file)
    console.emit(inspection.as_json())
    console.say(f"{file}: {inspection.contract}, {inspection.purpose}")
    complete = _show_content(inspection)
    if inspection.columns and not complete:
        headings = ("column", "unit", "type", "min", "max", "nulls")
        rows = [[_number(column[key]) for key in headings] for column in inspection.columns]
        console.say(f"\n{inspection.rows} rows")
        console.table(headings, rows, numbers="min, max, nulls")
    _show_facts("Where it came from", _folded(inspection.origin))
    if not (complete and inspection.contract.startswith("verdict/")):
        _show_facts("Metadata", inspection.metadata)
    # After all that can be shown, because a fault also sets the exit code.
    if inspection.fault:
        raise inspection.fault


def _show_content(inspection: "Inspection") -> bool:
    """Show a model, candidates or a verdict as text; return whether the file is one of these."""
    from pipelines.contracts import CANDIDATES, PARAMETERS, joints_of

    if inspection.fault:
        return False
    if inspection.contract == PARAMETERS.label:
        from exoid_cli.parameters_view import show_parameters

        console.say("")
        rows = PARAMETERS.load(inspection.file)[0].to_pylist()
        show_parameters(rows, joints_of(inspection.metadata))
        return True
    if inspection.contract == CANDIDATES.label:
        _show_candidates(CANDIDATES.load(inspection.file)[0].to_pylist())
        return True
    if inspection.contract.startswith("verdict/"):
        from exoid_cli.verdict_view import show_verdict
        from pipelines.contracts.verdict import Verdict

        console.say("")
        verdict = Verdict.model_validate(inspection.metadata)
        show_verdict(verdict, joints_of(inspection.metadata))
        return True
    return False


def _show_candidates(rows: list[dict[Any, Any]]) -> None:
    """Print the decision on each of the first candidates, and its reason."""
    from pipelines.wording.causes import any_label_in_words, labels_in_words

    labels = {label for row in rows for label in row["causes"]}
    for row in rows[:10]:
        causes = " + ".join(map(any_label_in_words, row["causes"]))
        console.say(f"\n{row['rank']} {causes}: {row['verdict']}")
        console.note(labels_in_words(row["reason"], labels))
    if len(rows) > 10:
        console.say(f"\n{len(rows) - 10} more are in the file")


def _folded(origin: dict[str, Any]) -> dict[str, Any]:
    """Shorten the origin: the number of settings, and the first characters of each hash."""
    folded = dict(origin)
    if "config" in origin:
        settings = _lines({"config": origin["config"]})
        folded["config"] = f"{len(settings)} settings; --json shows them"
    if "software" in origin:
        versions = (f"{name} {version}" for name, version in origin["software"].items())
        folded["software"] = ", ".join(versions)
    if "inputs" in origin:
        # Twelve characters of a hash distinguish files.
        inputs = {one["name"]: f"sha256 {one['sha256'][:12]}…" for one in origin["inputs"]}
        folded["inputs"] = inputs or "none"
    return folded


def _show_facts(title: str, facts: dict[str, Any]) -> None:
    # Lists of like objects are tables of their own; as dotted keys they would fill pages.
    tables = {key: value for key, value in facts.items() if _is_table(value)}
    lines = _lines({key: value for key, value in facts.items() if key not in tables})
    if lines:
        console.say("")
        console.table((title, ""), lines)
    for key, rows in tables.items():
        console.say(f"\n{key}")
        console.table(list(rows[0]), [[_in_short(cell) for cell in row.values()] for row in rows])


def _is_table(value: Any) -> bool:
    """Return whether a value is several objects of the same few keys, none of them nested."""
    if not isinstance(value, list) or len(value) < 2:
        return False
    if not all(isinstance(row, dict) for row in value):
        return False
    # Wider ones would not fit a terminal.
    return len(value[0]) <= 8 and all(
        row.keys() == value[0].keys()
        and not any(isinstance(cell, dict | list) for cell in row.values())
        for row in value
    )


def _lines(facts: dict[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """Write nested objects as dotted keys, one line each."""
    lines: list[tuple[str, str]] = []
    for key, value in facts.items():
        if isinstance(value, dict) and value:
            lines += _lines(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value):
                lines += _lines(item, f"{prefix}{key}[{number}].")
        else:
            lines.append((f"{prefix}{key}", _in_short(value)))
    return lines


def _in_short(value: Any) -> str:
    if not isinstance(value, list):
        return str(_number(value))
    if len(value) > 6 or any(isinstance(item, list) for item in value):
        rows = f"{len(value)} x {len(value[0])}" if isinstance(value[0], list) else str(len(value))
        return f"{rows} values; --json shows them"
    return ", ".join(map(_in_short, value)) or "none"


def _number(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else value
