"""Columns that say of which machine or in which unit a row is, or whether its values are good."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.importing.finding import Finding, counted
from pipelines.importing.naming.words import plain_words

_OF_MACHINES = (
    "id node device machine robot serial axis joint leg unit slave station actuator",
    "geraet achse knoten gelenk maschine seriennummer",
    "appareil axe noeud",
)
MACHINES = frozenset(word for words in _OF_MACHINES for word in words.split())
"""Words for a machine or a joint of which a row may be."""
GOOD = frozenset({"quality", "valid", "validity", "qualitaet", "gueltig", "qualite", "valide"})
"""Words for a column that says whether others have good values."""
UNITS = frozenset({"unit", "units", "einheit", "einheiten", "unite", "unites"})
"""Words for a column of the unit of each row, as of a display that changes its range."""
NUMBER = frozenset({"number", "no", "nr", "name", "code", "address", "addr", "num", "nummer"})
MOST = 20
"""Values of a label; a column with more is a quantity."""


def labels_in(names: Sequence[str]) -> list[str]:
    """Return the columns whose names say that they are labels of the rows."""
    return [name for name in names if _kind(name)]


def _kind(name: str) -> str:
    words = set(plain_words(name))
    if words & GOOD:
        return "quality"
    only = {word for word in words if not word.isdigit()}
    if only & MACHINES and only <= MACHINES | NUMBER:
        return "machine"
    return "unit" if words & UNITS else ""


def check(labels: Mapping[str, NDArray]) -> Iterator[Finding]:
    """Report labels of several values among the rows of a recording.

    Parameters
    ----------
    labels : mapping of str to (n,) array
        Columns that `labels_in` names, in the rows that are recorded.

    Yields
    ------
    Finding
        One for each label.
    """
    for name, values in labels.items():
        counts = pd.Series(values).dropna().value_counts()
        if not (_are_labels(values) and 1 < len(counts) <= MOST):
            continue
        some = ", ".join(f"{value} in {counted(n, 'row')}" for value, n in counts[:3].items())
        if _kind(name) == "quality":
            action = "all kept; delete rows whose values are no measurements"
        elif _kind(name) == "unit":
            action = "all read in the unit of the map; let the logger write one unit in all rows"
        else:
            action = "all kept as one machine; if they are of several, give each a file of its own"
        yield Finding("rows", f"{name!r} is {some}", action)


def _are_labels(values: NDArray) -> bool:
    """Return whether values (n,) are text or whole numbers; dates and measurements are not."""
    if values.dtype.kind == "f":  # whole numbers become floats where some are missing
        known = values[np.isfinite(values)]
        return bool(np.all(known == np.round(known)))
    return values.dtype.kind in "OUSbiu"
