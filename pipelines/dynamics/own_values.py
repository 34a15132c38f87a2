"""Which values a simulated run gets of a cause that every run has its own of: an encoder's zero, an onset, a phase."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import recording_behind
from pipelines.contracts.table import Table
from pipelines.model import Model, Term, term_from


def with_own_values(model: Model, table: Table, recording: Path | None) -> tuple[Model, tuple[str, ...]]:
    """Return a model with the values of the run that it is to simulate, and what had to be guessed of them.

    A run that the diagnosis has seen gets what ``parameters/1`` tells of it; what never came there is left out. Any
    other, and a loop that is of no recording, keeps the values in the table's rows, the first training run's: nobody
    knows its own, and those of one run are as good a guess as another's.
    """
    told: Mapping[str, list[dict[str, Any]]] = table.metadata.get("each_run") or {}
    this = recording_behind(recording) if recording else None
    terms, guesses = [], []
    for term in model:
        label, own = term.effect.label, [p.name for p in term.effect.parameters if p.per_run]
        runs = told.get(label, [])
        values = next((one["values"] for one in runs if one["sha256"] == this), None)
        if values is not None:
            terms += [_with(term, values)] if None not in values.values() else []
            continue
        terms.append(term)
        if own:
            of = f"that of {runs[0]['name']}, the first run it tells of" if runs else "that of its rows"
            why = f"{table.path} tells none of {recording}" if recording else "this loop is no recorded run"
            guesses.append(f"{label}: each run has its own {' and '.join(own)}, and {why}; taken is {of}")
    return Model(tuple(terms)), tuple(guesses)


def _with(term: Term, values: Mapping[str, float]) -> Term:
    """Return a term with other values of some parameters."""
    names = [p.name for p in term.effect.parameters]
    return term_from(term.effect, dict(zip(names, term.effect.physical(term.values), strict=True)) | dict(values))
