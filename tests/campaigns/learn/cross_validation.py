"""Criteria learned without a world, or without a third of all forms, and judged on what was left
out."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from pipelines.diagnosis.criteria import HELD, Criteria
from pipelines.diagnosis.selection.prior import FEATURES, weights
from tests.campaigns.blind.splits import FOLDS, fold_of
from tests.campaigns.learn.learning import ascended, sessions_of, sets_of
from tests.campaigns.learn.objective import LogEvidence, Session, revisions
from tests.campaigns.learn.vector import from_vector, to_vector

TITLE = "Worlds and forms left out"
COLUMNS = ("left out", "learned from", "judged on", "learned without it", "as shipped")
ABOUT = """\
Measured by `python -m tests.campaigns.learn cross-validate --most {most}`. Each world is left
out in turn, and so is each third of the forms that effects have in the worlds. The criteria are
learned again from the other sessions and judged on those left out. Each learned number starts at
twice its shipped value, the prior's learned odds at zero. Numbers that are not learned, and the
choice of the sets that are compared, come from the shipped criteria, which were learned from all
sessions. So these losses are lower bounds. The last two columns are the mean log probability of the
truth. The evidence was stored by revision {revisions}."""
AWAY = 2.0
"""Factor by which each criterion is off where learning starts: none may be right because it was
right before."""


@dataclass(frozen=True)
class Part:
    """A part that was left out, and the probability of its truth."""

    name: str
    revisions: str
    """Of what made the evidence."""
    learned_from: int
    judged_on: int
    learned: float
    """Mean log probability of the truth, by criteria that never saw the part."""
    shipped: float
    """The same, by the criteria that exoid has, which were learned from all worlds and forms."""

    def as_row(self) -> list[str]:
        """Return it as ``COLUMNS`` has it."""
        return [
            self.name,
            str(self.learned_from),
            str(self.judged_on),
            f"{self.learned:.2f}",
            f"{self.shipped:.2f}",
        ]


def cross_validated(root: Path, most: int, workers: int, shipped: Criteria) -> Iterator[Part]:
    """Yield each part that is left out in turn: every world, then every fold of forms."""
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        sessions = list(sessions_of(root, (), set(), most, pool, shipped))
    for name, held in parts(sessions):
        rest = [session for session in sessions if session not in held]
        if held and rest:
            learned = _learned(rest, workers, shipped)
            scores = _scores(held, workers, (learned, replace(shipped, base_rate=0.0)))
            yield Part(name, revisions(sessions), len(rest), len(held), *scores)


def parts(sessions: Sequence[Session]) -> Iterator[tuple[str, list[Session]]]:
    """Yield the name and the sessions of each part, none for a fold whose forms no session
    hides."""
    for world in sorted({session.world for session in sessions}):
        yield f"world {world}", [session for session in sessions if session.world == world]
    for fold in range(FOLDS):
        yield f"forms of fold {fold}", [session for session in sessions if fold in _folds(session)]


def _folds(session: Session) -> set[int | None]:
    return {fold_of(one["effect"], one["form"]) for one in session.truth["hidden"]}


def away(criteria: Criteria) -> Criteria:
    """Return criteria with all learned numbers doubled, and the prior's learned odds at zero."""
    ignorant = {f.name: 0.0 for f in fields(Criteria) if f.name in FEATURES and f.name not in HELD}
    return replace(
        from_vector(to_vector(criteria) + np.log(AWAY), criteria), base_rate=0.0, **ignorant
    )


def _learned(sessions: Sequence[Session], workers: int, shipped: Criteria) -> Criteria:
    weigh = LogEvidence(sessions, workers)
    learned, *_ = ascended(weigh, sets_of(sessions), away(shipped))
    weigh.close()
    return learned


def _scores(sessions: Sequence[Session], workers: int, several: Sequence[Criteria]) -> list[float]:
    """Return the mean log probability of the truth under each of several criteria."""
    weigh, sets = LogEvidence(sessions, workers), sets_of(sessions)
    scores = [
        float(np.mean(sets.scores(weigh(criteria), weights(criteria)))) for criteria in several
    ]
    weigh.close()
    return scores
