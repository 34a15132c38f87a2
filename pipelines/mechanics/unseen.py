"""Ensure that a model is validated on data that no fit has seen."""

from collections.abc import Sequence
from itertools import combinations

from pipelines.errors import InputError
from pipelines.mechanics.run import Run


def refuse_seen(runs: Sequence[Run]) -> None:
    """Refuse a training and a validation run that were imported from the same rows of a log.

    Runs that were not imported are accepted, because their rows are unknown.

    Raises
    ------
    InputError
        If two runs share rows.
    """
    # Rows that may overlap between adjacent spans, because an import sorts as many that arrived
    # late.
    in_order = 20
    for one, other in combinations(runs, 2):
        shared = _shared_rows(one, other) if one.purpose != other.purpose else 0
        if shared > in_order:
            raise InputError(
                f"{other.file} ({other.purpose}) and {one.file} ({one.purpose}) have {shared} rows"
                f" of {one.metadata['imported']['source']} in common, expected none: validation"
                " needs data that no fit has seen; import them again with spans that do not"
                " overlap"
            )


def _shared_rows(one: Run, other: Run) -> int:
    first, second = (run.metadata.get("imported", {}) for run in (one, other))
    if not set(first.get("sha256", ())) & set(second.get("sha256", ())):
        return 0
    # Rows are given by the first and the last one, both included.
    begin, end = max(first["rows"][0], second["rows"][0]), min(first["rows"][1], second["rows"][1])
    return int(max(0, end - begin + 1))
