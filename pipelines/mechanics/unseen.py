"""What a model is judged on, no fit has seen: runs of one log share no rows."""

from collections.abc import Sequence
from itertools import combinations

from pipelines.errors import InputError
from pipelines.mechanics.run import Run

IN_ORDER = 20
"""Rows that may seem to be in two spans that touch: an import puts in order as many that arrived
out of order."""


def refuse_seen(runs: Sequence[Run]) -> None:
    """Refuse runs of which one trains and another validates, and that were imported from the same
    rows of a log.

    Raises
    ------
    InputError
        Where there are such; of runs that were not imported nothing is known, and none is refused.
    """
    for one, other in combinations(runs, 2):
        shared = _shared_rows(one, other) if one.purpose != other.purpose else 0
        if shared > IN_ORDER:
            raise InputError(
                f"{other.file} ({other.purpose}) and {one.file} ({one.purpose}) have {shared} rows"
                f" of {one.metadata['imported']['source']} in common, expected none: a model is"
                " judged on data that no fit has seen; import them again with spans that do not"
                " overlap"
            )


def _shared_rows(one: Run, other: Run) -> int:
    first, second = (run.metadata.get("imported", {}) for run in (one, other))
    if not set(first.get("sha256", ())) & set(second.get("sha256", ())):
        return 0
    begin, end = max(first["rows"][0], second["rows"][0]), min(first["rows"][1], second["rows"][1])
    return int(max(0, end - begin + 1))
