"""Logs in JSON: a list of records, records under a key, columns as lists, or one record a line."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipelines.errors import InputError
from pipelines.importing.sources.flatten import (
    Leaves,
    is_list_of_records,
    leaves_of,
    nested_source,
)
from pipelines.importing.sources.source import Source
from pipelines.settings.import_map import SourceSettings
from pipelines.validation.suggestion import suggestion


def open_json(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a JSON file.

    Raises
    ------
    InputError
        If it is no JSON, nested too deeply, or without names.
    """
    try:
        content, remarks = _content(path)
        leaves = _flattened(content, settings.table)
    except RecursionError as error:
        raise InputError(
            "nests lists or tables too deeply; write it again with fewer levels"
        ) from error
    if set(leaves) == {""}:
        raise InputError(
            "is a list of numbers without names, expected records with keys, or lists under names"
        )
    notes = (f"records under {settings.table}",) if settings.table else ()
    return nested_source(path, "JSON", leaves, notes, remarks=remarks)


def _content(path: Path) -> tuple[Any, tuple[str, ...]]:
    """Return what a file holds, and remarks on it."""
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    try:
        return json.loads(text), ()
    except json.JSONDecodeError as error:
        # Not one document: perhaps one record a line, as loggers append them.
        lines = [line for line in text.splitlines() if line.strip()]
        try:
            records = [json.loads(line) for line in lines[:-1]]
        except json.JSONDecodeError:
            records = []
        if not records:
            raise InputError(f"is not valid JSON: {error}; write it again") from error
        try:
            return [*records, json.loads(lines[-1])], ()
        except json.JSONDecodeError:
            # A logger that is stopped cuts its last line.
            return records, (f"the last line, {lines[-1][:40]!r}, is cut; left out",)


def _flattened(content: Any, table: str | None) -> Leaves:
    """Return the arrays below a table; without a name, of the only one that has records."""
    if table is None:
        columns = leaves_of(content)
        tops = {name.partition(".")[0] for name, values in columns.items() if values.size > 1}
        top = next(iter(tops), "")
        if len(tops) != 1 or not isinstance(content, Mapping) or not isinstance(content[top], list):
            return columns
        table = top
    below = content
    for key in table.split("."):
        if not isinstance(below, Mapping) or key not in below:
            known = [str(known) for known in below] if isinstance(below, Mapping) else []
            raise InputError(f"has no {key!r}, which source.table names; {suggestion(key, known)}")
        below = below[key]
    # Constants next to the table stay available to expressions, such as a gain.
    constants = {name: values for name, values in leaves_of(content).items() if values.size == 1}
    has_keys = isinstance(below, Mapping) or is_list_of_records(below)
    return leaves_of(below, "" if has_keys else table) | constants
