"""The search for the causes: which set of candidates earns its place on data held out from its fit.

Sets are scored by the logarithm of their held-out error in each output, on as many samples as are
independent. A beam of the best sets is extended by every candidate in turn, so that two causes which
only together explain the residual are found even where neither comes first alone. A cause may also stand beside
itself in another shape: what a freer form of one cause explains as well needs no second one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.bank import Bank
from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.gram import Gram, held_out_error, solve
from pipelines.diagnosis.imperfection import imperfection

BEAM = 10
"""Sets carried from one size to the next."""
MOST = 3
"""Causes in a set."""
SHAPE_COST = 2.0
"""What a shape parameter must gain, in units of log likelihood, for having been searched."""
CHANCE = 2.0
"""Log likelihood that a forbidden sign may gain by chance: the amplitude is nought then, within its noise."""


@dataclass(frozen=True)
class Scored:
    """A set of candidates and what it leaves."""

    chosen: tuple[int, ...]
    score: float
    """Log likelihood over the baseline's, on held-out data, less the cost of shapes."""
    error: NDArray
    """(O,) root mean square held-out error, N·m."""
    bound: bool = False
    """Whether an amplitude stands at nought, where physics forbids the sign that it plainly would have."""

    @property
    def admissible(self) -> bool:
        """Whether the set may be named as it is."""
        return bool(np.isfinite(self.score)) and not self.bound


def log_likelihood(rms: NDArray, before: NDArray, independent: NDArray, imperfect: NDArray) -> float:
    """Return what a model's errors gain over another's; all (O,), outputs without samples have none independent."""
    there = independent > 0
    ratio = (before[there] ** 2 + imperfect[there] ** 2) / (rms[there] ** 2 + imperfect[there] ** 2)
    return float(0.5 * np.sum(independent[there] * np.log(ratio)))


def cost(causes: Sequence[Candidate], columns: int, independent: NDArray) -> float:
    """Return what a set must gain for its parameters: Schwarz's price for each amplitude, and the shapes' search.

    ``independent`` (O,) counts each output's independent samples (Schwarz, 1978, Annals of Statistics 6(2))."""
    shapes = sum(len(c.effect.shape) for c in causes)
    return SHAPE_COST * shapes + 0.5 * columns * float(np.log(np.max(independent)))


def known_besides(causes: Sequence[Candidate], evidence: Mapping[str, float]) -> float:
    """Return the log likelihood known of causes besides what they do to the mean torque."""
    return sum(evidence.get(label, 0.0) for label in {cause.label for cause in causes})


class Scorer:
    """Scores sets of candidates against the baseline."""

    def __init__(self, bank: Bank, independent: NDArray, evidence: Mapping[str, float]) -> None:
        """Prepare.

        Parameters
        ----------
        independent : (O,) how many of each output's samples are independent
        evidence : log likelihood that is known of some causes besides what they do to the mean torque, by label
        """
        self.bank, self.independent, self.evidence = bank, independent, evidence
        self.count = bank.gram.count.sum(axis=0)
        self.imperfect = imperfection(bank.runs)
        self.plain = self._held_out(bank.gram.select(bank.columns_of(())))

    def __call__(self, chosen: Sequence[int]) -> Scored:
        """Score a set."""
        columns = self.bank.columns_of(chosen)
        gram = self.bank.gram.select(columns)
        forbidden = self._forbidden(gram, chosen)
        rms, bound = self._held_out(gram), False
        if forbidden.any():
            # What is left of a cause whose amplitude is nought: of a spring, its preload; of most causes, nothing.
            gram = self.bank.gram.select(columns[~forbidden])
            if self._empty(forbidden, chosen) or self._still_forbidden(gram, forbidden, chosen):
                return Scored(tuple(chosen), -np.inf, np.full(len(self.count), np.nan))
            free, rms = rms, self._held_out(gram)
            bound = log_likelihood(free, rms, self.independent, self.imperfect) > CHANCE
        causes = [self.bank.candidates[i] for i in chosen]
        gain = log_likelihood(rms, self.plain, self.independent, self.imperfect)
        besides = known_besides(causes, self.evidence)
        price = cost(causes, len(columns) - self.bank.baseline.size, self.independent)
        return Scored(tuple(chosen), gain + besides - price, rms, bound)

    def _held_out(self, gram: Gram) -> NDArray:
        return np.asarray(np.sqrt(held_out_error(gram, self.bank.weights) / np.maximum(self.count, 1)))

    def _forbidden(self, gram: Gram, chosen: Sequence[int]) -> NDArray:
        """Tell which columns come out with a sign that physics forbids, (columns,) bool."""
        return (solve(gram, self.bank.weights) < 0) & self._one_way(chosen)

    def _still_forbidden(self, gram: Gram, dropped: NDArray, chosen: Sequence[int]) -> bool:
        return bool(np.any((solve(gram, self.bank.weights) < 0) & self._one_way(chosen)[~dropped]))

    def _one_way(self, chosen: Sequence[int]) -> NDArray:
        """Tell which columns of a set may only have a positive amplitude, (columns,) bool."""
        parts = [np.zeros(self.bank.baseline.size, dtype=bool)]
        for i in chosen:
            candidate, width = self.bank.candidates[i], self._width(i)
            seen_otherwise = self.evidence.get(candidate.label, 0.0) > 0
            parts.append(one_way(candidate, width) & (not seen_otherwise))
        return np.concatenate(parts)

    def _empty(self, dropped: NDArray, chosen: Sequence[int]) -> bool:
        """Tell whether one of the set's causes has lost all its columns."""
        ends = np.cumsum([self._width(i) for i in chosen])[:-1]
        return any(part.all() for part in np.split(dropped[self.bank.baseline.size :], ends))

    def _width(self, i: int) -> int:
        return self.bank.columns[i].width


def one_way(candidate: Candidate, width: int) -> NDArray:
    """Tell which of a candidate's columns may only have a positive amplitude, (width,) bool."""
    effect = candidate.effect
    if candidate.bends:
        # A column is the effect at a shape: turned over, it would be a spring that pushes.
        return np.full(width, all(p.typical[0] > 0 and p.unit != "1" for p in effect.shape if p.default is None))
    positive = [p.typical[0] >= 0 for p in effect.linear]
    return np.array(positive) if len(positive) == width else np.zeros(width, dtype=bool)


def best_of_each_label(bank: Bank, scored: Sequence[Scored]) -> dict[tuple[str, ...], Scored]:
    """Keep, of all sets with the same effects at the same joints, the best shapes."""
    best: dict[tuple[str, ...], Scored] = {}
    for s in scored:
        key = tuple(sorted(bank.candidates[i].label for i in s.chosen))
        if key not in best or (s.admissible, s.score) > (best[key].admissible, best[key].score):
            best[key] = s
    return best


def search(scorer: Scorer, most: int = MOST) -> list[dict[tuple[str, ...], Scored]]:
    """Return, for each size of set from one up, the sets tried with their best shapes."""
    bank = scorer.bank
    singles = best_of_each_label(bank, [scorer((i,)) for i in range(len(bank.candidates))])
    levels = [singles]
    # Beside another cause a candidate may want another shape: its best few stay in the race.
    contenders = _contenders(scorer)
    for _ in range(1, most):
        different = [s for labels, s in levels[-1].items() if len(set(labels)) == len(labels)]
        beam = sorted(different, key=lambda s: -s.score)[:BEAM]
        tried = []
        for base in beam:
            tried += [scorer((*base.chosen, i)) for i in contenders if i not in base.chosen]
        levels.append(best_of_each_label(bank, tried))
    return levels


SHAPES = 3


def _contenders(scorer: Scorer) -> list[int]:
    by_label: dict[str, list[tuple[float, int]]] = {}
    for i, candidate in enumerate(scorer.bank.candidates):
        by_label.setdefault(candidate.label, []).append((-scorer((i,)).score, i))
    return [i for entries in by_label.values() for _, i in sorted(entries)[:SHAPES]]
