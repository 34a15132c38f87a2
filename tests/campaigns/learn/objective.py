"""What learning needs of sessions: the sets that matter, and their evidence under some criteria.

The sets of a session that matter are found once under reference criteria; under others only these
are weighed again, so that thousands of sessions can be scored many times.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.evidence import Evidence
from pipelines.diagnosis.selection.marginal_likelihood import MarginalLikelihood
from pipelines.diagnosis.selection.posterior import Posterior, Set, posterior
from pipelines.diagnosis.selection.prior import features, of_set
from tests.campaigns.learn.packing import unpacked
from tests.campaigns.learn.truth import Right, right_sets

SETS = 80
"""Sets of a session that are weighed again."""


@dataclass(frozen=True)
class Session:
    """One session's evidence, reduced to the sets that matter."""

    name: str
    world: str
    revision: str
    """Of what made the evidence."""
    truth: dict[str, Any]
    evidence: Evidence
    sets: tuple[Set, ...]
    right: NDArray
    """(sets,) bool."""
    features: NDArray
    """(sets, features) by which the prior knows them."""


def rows(root: Path, worlds: Sequence[str] = ()) -> Iterator[dict[str, Any]]:
    """Yield the stored rows that have evidence."""
    for file in sorted((root / "evidence").glob("*/*.parquet")):
        if worlds and file.parent.name not in worlds:
            continue
        row = pq.read_table(file).to_pylist()[0]
        if "revision" not in row:
            raise ValueError(
                f"{file}: stored before revisions were; remove it, and run `make evidence`"
            )
        if not row["refused"]:
            yield row


def revisions(sessions: Iterable[Session]) -> str:
    """Return the revisions that made the sessions' evidence, commas between."""
    return ", ".join(sorted({session.revision for session in sessions}))


def reduced(row: dict[str, Any], criteria: Criteria) -> Session:
    """Return a session with the sets that matter under some criteria."""
    truth, evidence = json.loads(row["truth"]), unpacked(row)
    right = right_sets(truth)
    kept = _kept(posterior(evidence, criteria), right)
    return Session(
        row["name"], row["world"], row["revision"], truth, *_compact(evidence, kept, right)
    )


def _kept(weighed: Posterior, right: Right) -> list[Set]:
    """Return the most probable sets, and the most probable right ones."""

    def labels(chosen: Set) -> frozenset[str]:
        return frozenset(weighed.elements[i].label for i in chosen)

    true = [chosen for chosen in weighed.sets if right(labels(chosen))][: SETS // 4]
    return list(dict.fromkeys((*weighed.sets[:SETS], *true, ())))


def _compact(
    evidence: Evidence, sets: Sequence[Set], right: Right
) -> tuple[Evidence, tuple[Set, ...], NDArray, NDArray]:
    """Keep the elements and columns that sets need, and the background's."""
    elements = sorted({i for chosen in sets for i in chosen})
    columns = {place for place, *_ in evidence.background}
    for i in elements:
        e = evidence.elements[i]
        columns.update((*e.columns, *e.derivative))
    kept = np.array(sorted(columns))
    new = {int(old): n for n, old in enumerate(kept)}

    def moved(places: Sequence[int]) -> list[int]:
        return [new[p] for p in places]

    own = tuple(
        replace(e, columns=moved(e.columns), derivative=moved(e.derivative))
        for e in (evidence.elements[i] for i in elements)
    )
    square, known = np.ix_(kept, kept), evidence.nonnegative
    small = replace(
        evidence,
        gram=evidence.gram[:, *square].astype(np.float32),
        right=evidence.right[:, kept],
        elements=own,
        background=tuple((new[p], v, n) for p, v, n in evidence.background),
        nonnegative=known and replace(known, imitation=known.imitation[:, kept]),
    )
    number = {i: n for n, i in enumerate(elements)}
    chosen = tuple(tuple(number[i] for i in s) for s in sets)
    true = np.array([right(frozenset(own[i].label for i in s)) for s in chosen])
    of_elements = [features(e, evidence.auxiliary) for e in own]
    set_features = np.array([of_set([of_elements[i] for i in s]) for s in chosen])
    return small, chosen, true, set_features


def log_evidence(session: Session, criteria: Criteria) -> NDArray:
    """Return the log Bayes factor of each set, (sets,)."""
    weigh = MarginalLikelihood(session.evidence, criteria)
    return np.array([weigh.log_evidence(chosen) for chosen in session.sets])


class LogEvidence:
    """Weighs many sessions on several processes, which have them from the beginning."""

    def __init__(self, sessions: Sequence[Session], workers: int) -> None:
        """Fork the processes: what they would otherwise be sent at each call is gigabytes."""
        global _SESSIONS
        _SESSIONS = sessions
        self._pool = get_context("fork").Pool(workers)
        self._count = len(sessions)

    def __call__(self, criteria: Criteria) -> NDArray:
        """Return the log Bayes factors of all sessions' sets, (sessions, sets)."""
        jobs = [(i, criteria) for i in range(self._count)]
        return padded(self._pool.map(_weighed, jobs, chunksize=4), -np.inf)

    def close(self) -> None:
        """End the processes."""
        self._pool.terminate()
        self._pool.join()


def padded(rows: Sequence[NDArray], value: float) -> NDArray:
    """Put arrays (k, ...) of different lengths over one another, (rows, longest, ...)."""
    longest = max(len(row) for row in rows)
    out = np.full((len(rows), longest, *rows[0].shape[1:]), value)
    for own, row in zip(out, rows, strict=True):
        own[: len(row)] = row
    return out


_SESSIONS: Sequence[Session] = ()


def _weighed(job: tuple[int, Criteria]) -> NDArray:
    number, criteria = job
    return log_evidence(_SESSIONS[number], criteria)
