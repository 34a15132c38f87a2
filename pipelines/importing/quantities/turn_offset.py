"""In which turn of its counter each log of a map begins: what starts anew tells its place within a
turn, not which."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Finding


class Beginnings:
    """Where the counters of the logs that were looked at began."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[float, str]] = {}

    def look_at(
        self, log: str, columns: Mapping[str, NDArray], turns: Mapping[str, float]
    ) -> Iterator[Finding]:
        """Yield what begins more than half a turn from where the first log did: it would be nearer
        in another turn.

        ``columns`` (n,) are in SI, and ``turns`` what a turn of each counter is in SI.
        """
        for name, turn in turns.items():
            known = columns[name][np.isfinite(columns[name])]
            if not len(known):
                continue
            begins = float(known[0])
            first, of = self._first.setdefault(name, (begins, log))
            away = round((begins - first) / turn)
            if away:
                seen = (
                    f"begins at {begins:.4g} and in {of} at {first:.4g}, about {abs(away)} of its"
                    " counter's turns apart"
                )
                yield Finding(
                    name, seen, "kept; if all logs begin alike, say with begins_at at which reading"
                )
