"""``exoid show``: what a file is, where it came from, and what is in it."""

from pathlib import Path
from typing import Annotated, Any

import typer

from exoid_cli.console import console


def show(
    file: Annotated[Path, typer.Argument(help="A Parquet or JSON file of exoid's, or a trajectory as TOML.")],
) -> None:
    """Say what an exoid file is, where it came from, and its columns with units and ranges.

    \b
    Example:
      exoid show recordings/with_human_train.parquet
    """
    from pipelines.contracts.inspection import inspect

    found = inspect(file)
    console.emit(found.as_json())
    console.say(f"{file}: {found.contract}, {found.purpose}")
    if found.columns:
        headings = ("column", "unit", "type", "min", "max", "nulls")
        rows = [[column[heading] for heading in headings] for column in found.columns]
        console.say(f"\n{found.rows} rows")
        console.table(headings, [_shortened(row) for row in rows], numbers="min, max, nulls")
    _show_facts("Where it came from", _folded(found.origin))
    _show_facts("Metadata", found.metadata)
    if found.fault:
        raise found.fault


def _folded(origin: dict[str, Any]) -> dict[str, Any]:
    """Say of the settings only that they are there: they are a screenful."""
    if "config" not in origin:
        return origin
    return {**origin, "config": f"{len(_lines({'config': origin['config']}))} settings; --json shows them"}


def _show_facts(title: str, facts: dict[str, Any]) -> None:
    if facts:
        console.say("")
        console.table((title, ""), _lines(facts))


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
            lines.append((f"{prefix}{key}", str(value)))
    return lines


def _shortened(row: list[Any]) -> list[Any]:
    return [f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row]
