"""How well runs separate rival causes: expected log odds, and the posterior to expect.

A true cause A adds a torque r to the rows of a detection problem, which are in units of the noise
and have no part that the baseline explains. A rival B with the orthonormal span Q explains |Q'r|²
of it. The log likelihood of A then exceeds that of B by half of

    |r|² - |Q'r|²

in the mean (T-optimality: Atkinson and Fedorov, 1975, Biometrika 62(1)). Each amplitude costs half
the logarithm of the independent samples. As in a diagnosis, no form is exact: an output counts less
where causes explain more of it.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detectability import NEVER_APART
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import orthonormal
from pipelines.diagnosis.selection.marginal_likelihood import power
from pipelines.investigation.rivals import Appearance, SizedRival, unit_torque

DECIDED = 0.95
"""Posterior probability of one rival from which the others are excluded."""


@dataclass(frozen=True)
class Separation:
    """How well some runs separate R rivals."""

    rivals: tuple[SizedRival, ...]
    truths: tuple[tuple[Appearance, ...], ...]
    """Each rival as the true cause, at its probable shapes."""
    shapes: tuple[tuple[Appearance, ...], ...]
    """Each rival at all shapes with which it could explain another one."""
    price: float
    """Log likelihood that each amplitude costs."""
    noise: NDArray
    """(rows,) its standard deviation; below one where the model's error counts."""

    @classmethod
    def of(cls, rivals: Sequence[SizedRival], problem: DetectionProblem) -> "Separation":
        """Compute how the rivals look in a detection problem's rows.

        Parameters
        ----------
        rivals : sequence of SizedRival
        problem : DetectionProblem
            Planned or recorded runs.
        """
        # The mean over all truths: the rivals stand for one torque.
        squares = np.mean(
            [
                (amplitude * unit_torque(candidate, problem)) ** 2
                for sized in rivals
                for candidate, amplitude in sized.truths
            ],
            axis=0,
        )
        explained = np.bincount(problem.outputs, squares, minlength=len(problem.root))
        weights = power(explained, 1.0, CRITERIA.model_error)
        weighted = problem.weighted(weights)
        looks = [{one: Appearance.of(one, weighted) for one in sized.shapes} for sized in rivals]
        truths = (
            tuple(
                replace(own[candidate], torque=amplitude * own[candidate].torque)
                for candidate, amplitude in sized.truths
            )
            for sized, own in zip(rivals, looks, strict=True)
        )
        return cls(
            tuple(rivals),
            tuple(truths),
            tuple(tuple(own.values()) for own in looks),
            0.5 * float(np.log(problem.independent)),
            np.sqrt(weights[problem.outputs]),
        )

    @property
    def labels(self) -> list[str]:
        """Of the rivals, ``effect@joint``."""
        return [sized.rival.label for sized in self.rivals]

    def log_odds(self) -> NDArray:
        """Return the expected log odds (R, R) of each truth against each rival, priors apart.

        The mean over the truth's shapes; of the rival, the shape counts that is most alike.
        """
        odds = np.zeros((len(self.rivals), len(self.rivals)))
        for i, of_truth in enumerate(self.truths):
            for j, of_rival in enumerate(self.shapes):
                if i != j:
                    odds[i, j] = np.mean([self._against(one, of_rival) for one in of_truth])
        return odds

    def least(self) -> float:
        """Return the least of the expected log odds: the worst pair counts."""
        odds = self.log_odds()
        return float(np.min(odds[~np.eye(len(odds), dtype=bool)]))

    def inseparable(self) -> list[tuple[str, str]]:
        """Return the pairs of rivals of which each explains nearly all of the other's torque."""
        pairs = itertools.combinations(range(len(self.rivals)), 2)
        return [
            (self.labels[i], self.labels[j])
            for i, j in pairs
            if max(self._share(i, j), self._share(j, i)) < NEVER_APART
        ]

    def _share(self, i: int, j: int) -> float:
        """Return the largest share of a truth's power that a rival does not explain."""
        shares = (
            min(1.0 - _squared(rival.span.T @ truth.torque) / whole for rival in self.shapes[j])
            for truth in self.truths[i]
            if (whole := _squared(truth.torque)) > 0.0
        )
        return max(shares, default=0.0)

    def as_json(self) -> dict[str, Any]:
        """Return the rivals, the expected log odds, and the posterior to expect."""
        posterior = self.posterior()
        return {
            "rivals": [
                {"cause": sized.rival.label, "probability": sized.rival.probability}
                for sized in self.rivals
            ],
            "expected_log_odds": self.log_odds().tolist(),
            "expected_posterior": posterior.mean(axis=1).tolist(),
            "decided": decided(posterior).tolist(),
        }

    def _against(self, truth: Appearance, rivals: Sequence[Appearance]) -> float:
        """Return the expected log odds of a truth against the rival shape that is most alike."""
        of_truth, width = _squared(truth.torque), truth.span.shape[1]
        return min(
            0.5 * float(of_truth - _squared(rival.span.T @ truth.torque))
            + self.price * (rival.span.shape[1] - width)
            for rival in rivals
        )

    def posterior(self, draws: int = 400, seed: int = 1) -> NDArray:
        """Simulate the experiment and return the posteriors of all rivals under each truth.

        Parameters
        ----------
        draws : int, optional
            Simulated experiments for each truth, over all its shapes.
        seed : int, optional
            Of their noise.

        Returns
        -------
        (R, draws, R) array
            Truth, experiment, rival.
        """
        rng = np.random.default_rng(seed)
        flat = [shape for own in self.shapes for shape in own]
        # Only the part of the rows that some rival can explain distinguishes them.
        basis = orthonormal(np.hstack([shape.span for shape in flat]))
        spans = [[basis.T @ shape.span for shape in own] for own in self.shapes]
        prior = np.log([sized.rival.probability for sized in self.rivals])
        prices = np.array([self.price * own[0].shape[1] for own in spans])
        result = np.zeros((len(self.rivals), draws, len(self.rivals)))
        for i, own in enumerate(self.truths):
            torques = np.array([basis.T @ shape.torque for shape in own])
            noise = rng.standard_normal((draws, len(self.noise))) * self.noise
            y = torques[np.arange(draws) % len(own)] + noise @ basis
            # Power that each shape of each rival explains, (shapes, draws).
            explained = [np.array([_squared(y @ q) for q in of_rival]) for of_rival in spans]
            evidence = np.array(
                [
                    logsumexp(0.5 * of_rival, axis=0) - np.log(len(of_rival))
                    for of_rival in explained
                ]
            )
            log = evidence.T + prior - prices
            result[i] = np.exp(log - logsumexp(log, axis=1, keepdims=True))
        return result


def decided(posterior: NDArray) -> NDArray:
    """Return the share of experiments (R,) after which each true cause has ``DECIDED``.

    Parameters
    ----------
    posterior : (R, draws, R) array
        Truth, experiment, rival, as of ``Separation.posterior``.
    """
    of_truth = np.diagonal(posterior, axis1=0, axis2=2)
    return np.mean(of_truth >= DECIDED, axis=0)


def _squared(x: NDArray) -> NDArray:
    """Return the sum of squares along the last axis."""
    return np.sum(x * x, axis=-1)
