"""Values that differ from run to run: an encoder's zero, an onset, a phase."""

from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import recording_behind
from pipelines.contracts.table import Table
from pipelines.model import Model, Term, term_from


def with_own_values(
    model: Model, table: Table, recording: Path | None
) -> tuple[Model, tuple[str, ...]]:
    """Return a model with the values of one run, and remarks on values that were guessed.

    A run that the diagnosis used has its values in the metadata of ``parameters/1``; a term that is
    absent there is dropped. Any other run, and a control loop without a recording, keeps the values
    in the table's rows, which are those of the first training run.

    Parameters
    ----------
    model : Model
        Model with the values of the table's rows.
    table : Table
        The ``parameters/1`` table.
    recording : Path, optional
        File of the run; None for a control loop.
    """
    # A motion has the hash of the recording that it was filtered from.
    this = recording_behind(recording) if recording else None
    terms = [(own_term(term, table, this), guess(term, table, this, recording)) for term in model]
    return Model(tuple(term for term, _ in terms if term)), tuple(
        sentence for _, sentence in terms if sentence
    )


def own_term(term: Term, table: Table, sha256: str | None) -> Term | None:
    """Return a term with the values of one recording.

    Parameters
    ----------
    term : Term
        Term with the values of the table's rows.
    table : Table
        The ``parameters/1`` table.
    sha256 : str, optional
        Hash of the recording.

    Returns
    -------
    Term or None
        ``term`` itself if the table has no values for the recording; None if the term is absent
        there.
    """
    values = _stated(term, table, sha256)
    if values is None:
        return term
    # A value of None marks a term that this run does not have.
    if None in values.values():
        return None
    physical = term.effect.physical(term.values)
    of_rows = zip([p.name for p in term.effect.parameters], physical, strict=True)
    return term_from(term.effect, dict(of_rows) | values)


def guess(term: Term, table: Table, sha256: str | None, recording: Path | None) -> str | None:
    """Explain the fallback used when the table has no values for this recording.

    Parameters
    ----------
    term : Term
        Term with values that may differ from run to run.
    table : Table
        A ``parameters/1`` table.
    sha256 : str or None
        Hash of the recording; None without one.
    recording : Path or None
        Its path, for the message.

    Returns
    -------
    str or None
        None if no fallback was needed.
    """
    own = [p.name for p in term.effect.parameters if p.per_run]
    if not own or _stated(term, table, sha256) is not None:
        return None
    label, runs = term.effect.label, _runs(term, table)
    source = f"that of {runs[0]['name']}, its first run," if runs else "that of its rows"
    reason = f"{table.path} has none for {recording}" if recording else "this loop has no recording"
    return f"{label}: each run has its own {' and '.join(own)}, but {reason}; {source} is used"


def _runs(term: Term, table: Table) -> list[dict[str, Any]]:
    return (table.metadata.get("each_run") or {}).get(term.effect.label, [])


def _stated(term: Term, table: Table, sha256: str | None) -> dict[str, float | None] | None:
    return next((one["values"] for one in _runs(term, table) if one["sha256"] == sha256), None)
