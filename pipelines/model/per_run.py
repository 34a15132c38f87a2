"""Which values one run has of a cause that every run has its own of: an encoder's zero, an onset, a
phase."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import recording_behind
from pipelines.contracts.table import Table
from pipelines.model import Model, Term, term_from


def with_own_values(
    model: Model, table: Table, recording: Path | None
) -> tuple[Model, tuple[str, ...]]:
    """Return a model with the values of the run that it is of, and what had to be guessed of them.

    A run that the diagnosis has seen gets what ``parameters/1`` tells of it; what never came there
    is left out. Any other, and a loop that is of no recording, keeps the values in the table's
    rows, the first training run's: nobody knows its own, and those of one run are as good a guess
    as another's.
    """
    this = recording_behind(recording) if recording else None
    terms = [(own_term(term, table, this), guess(term, table, this, recording)) for term in model]
    return Model(tuple(term for term, _ in terms if term)), tuple(
        sentence for _, sentence in terms if sentence
    )


def own_term(term: Term, table: Table, sha256: str | None) -> Term | None:
    """Return a term as the recording of a hash has it; as it is where the table tells none, None if
    it never came."""
    values = _stated(term, table, sha256)
    if values is None:
        return term
    return None if None in values.values() else _with(term, values)


def guess(term: Term, table: Table, sha256: str | None, recording: Path | None) -> str | None:
    """Say what ``own_term`` had to take in the place of a recording's own values; None where it had
    not."""
    own = [p.name for p in term.effect.parameters if p.per_run]
    if not own or _stated(term, table, sha256) is not None:
        return None
    label, runs = term.effect.label, _runs(term, table)
    of = f"that of {runs[0]['name']}, the first run it tells of" if runs else "that of its rows"
    why = f"{table.path} tells none of {recording}" if recording else "this loop is no recorded run"
    return f"{label}: each run has its own {' and '.join(own)}, and {why}; taken is {of}"


def _runs(term: Term, table: Table) -> list[dict[str, Any]]:
    return (table.metadata.get("each_run") or {}).get(term.effect.label, [])


def _stated(term: Term, table: Table, sha256: str | None) -> dict[str, float | None] | None:
    return next((one["values"] for one in _runs(term, table) if one["sha256"] == sha256), None)


def _with(term: Term, values: Mapping[str, float | None]) -> Term:
    """Return a term with other values of some parameters."""
    names = [p.name for p in term.effect.parameters]
    return term_from(
        term.effect, dict(zip(names, term.effect.physical(term.values), strict=True)) | dict(values)
    )
