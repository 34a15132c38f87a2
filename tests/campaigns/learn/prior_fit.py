"""The prior's weights that give the truth most probability, with the evidence of all sets given."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import logsumexp

from pipelines.diagnosis.criteria import HELD
from pipelines.diagnosis.selection.prior import FEATURES

FLOOR = 1e-4
"""Probability that a truth has at least: one hopeless session must not decide."""
SPREAD = 3.0
"""Standard deviation of the weights about those at the start: keeps one without evidence."""
POSITIVE = ("coherence_weight",)
"""Weights that are not negative: evidence for a cause never makes it less likely."""


@dataclass(frozen=True)
class Sets:
    """What is known of n sessions' sets but for their evidence."""

    features: NDArray
    """(n, sets, features)."""
    right: NDArray
    """(n, sets) 1 where a set is the truth, 0 elsewhere."""
    weights: NDArray
    """(n,) of the sessions; they add up to one."""

    def scores(self, evidence: NDArray, prior: NDArray) -> NDArray:
        """Return the log probability of each session's truth, (n,)."""
        return np.log((1.0 - FLOOR) * self._truth(evidence + self.features @ prior)[0] + FLOOR)

    def _truth(self, odds: NDArray) -> tuple[NDArray, NDArray]:
        """Return the probability of each truth (n,) and of each set (n, sets)."""
        p = np.exp(odds - logsumexp(odds, axis=1, keepdims=True))
        return np.sum(p * self.right, axis=1), p

    def fit(self, evidence: NDArray, start: NDArray) -> tuple[NDArray, float]:
        """Return the weights of the features that score best, and the mean score."""

        def cost(prior: NDArray) -> tuple[float, NDArray]:
            truth, p = self._truth(evidence + self.features @ prior)
            likely = (1.0 - FLOOR) * truth + FLOOR
            pull = (1.0 - FLOOR) * p * (self.right - truth[:, np.newaxis]) / likely[:, np.newaxis]
            gradient = np.einsum("n,ns,nsf->f", self.weights, pull, self.features)
            off = (prior - start) / SPREAD
            value = -float(self.weights @ np.log(likely)) + 0.5 * float(off @ off) / len(truth)
            return value, -gradient + off / SPREAD / len(truth)

        free = {name: (0.0, 1.0) if name in POSITIVE else (None, None) for name in FEATURES}
        held = {
            name: (value, value)
            for name, value in zip(FEATURES, start.tolist(), strict=True)
            if name in HELD
        }
        bounds = list((free | held).values())
        minimum = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
        return minimum.x, float(self.weights @ self.scores(evidence, minimum.x))
