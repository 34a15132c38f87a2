"""How well runs separate rival causes: expected log odds, and the posterior to expect.

A true cause A adds a torque r to the rows of a detection problem, which are in units of the noise
and have no part that the baseline explains. What a good rig has of every cause is noise, too, so
rows are whitened (``DetectionProblem.whitened``). A rival B with the orthonormal span Q explains
|Q'r|² of it. The log likelihood of A then exceeds that of B by half of

    |r|² - |Q'r|²

in the mean (T-optimality: Atkinson and Fedorov, 1975, Biometrika 62(1)). As in a diagnosis,
amplitudes have a prior and are integrated out (``Appearance``), and no form is exact: an output
counts less where causes explain more of it.

After a diagnosis the rows are those of its runs and of further ones. What the former showed is
known, and is in the probabilities of the rivals: only the difference of both log likelihoods
counts. If nothing is missing, the further runs do not show again what noise seemed to show.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detectability import NEVER_APART
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.selection.marginal_likelihood import power
from pipelines.investigation.doubt import DECIDED
from pipelines.investigation.sized_rival import Appearance, SizedRival, parts_in

Pair = tuple[str, str]
"""Labels of two rivals."""


@dataclass(frozen=True)
class Separation:
    """How well some runs separate R rivals."""

    rivals: tuple[SizedRival, ...]
    truths: tuple[NDArray, ...]
    """Rows without noise of each rival as the true cause, (n, rows), at its n probable sizes.
    Diagnosed runs have what they showed, whichever is true."""
    shapes: tuple[tuple[Appearance, ...], ...]
    """Each rival at all shapes with which it could explain another one."""
    problem: DetectionProblem
    """Weighted: less where the model's error counts."""
    root: NDArray
    """(rows,) root of its weights."""
    is_planned: NDArray
    """(rows,) whether the run is not diagnosed yet; what the others showed is known."""
    unweighted: tuple[NDArray, ...]
    """As ``truths``, without weights, and with each rival's own torque in diagnosed runs."""
    earlier: "Separation | None"
    """The same in the diagnosed runs alone, whose result is the rivals' probability."""

    @classmethod
    def of(
        cls,
        rivals: Sequence[SizedRival],
        problem: DetectionProblem,
        earlier: "Separation | None" = None,
        diagnosed: int = 0,
    ) -> "Separation":
        """Compute how the rivals look in a detection problem's rows.

        Parameters
        ----------
        rivals : sequence of SizedRival
        problem : DetectionProblem
            Planned or recorded runs.
        earlier : Separation, optional
            Of the runs that were diagnosed.
        diagnosed : int, optional
            How many of the problem's runs, the first ones, these are.
        """
        rows = len(problem.outputs)
        # Once of each shape, since a motion's torques take most of a search.
        parts = [{one: parts_in(problem, one) for one in sized.shapes} for sized in rivals]
        own = tuple(
            np.array(
                [truth.torque(problem, of_rival[truth.candidate]) for truth in sized.truths]
                or [np.zeros(rows)]
            )
            for sized, of_rival in zip(rivals, parts, strict=True)
        )
        weights = _weights(own, problem)
        weighted = problem.weighted(weights)
        root = np.sqrt(weights[problem.outputs])
        counts = (int(run.usable.sum()) for run in problem.runs)
        is_planned = np.concatenate([np.full(n, r >= diagnosed) for r, n in enumerate(counts)])
        known = earlier.unweighted if earlier else tuple(one * ~is_planned for one in own)
        seen = [_seen(sized, rivals, known) for sized in rivals]
        truths = [
            _with_known(one, before, shown, root, weighted)
            for one, before, shown in zip(own, known, seen, strict=True)
        ]
        if earlier:
            # What diagnosed runs showed and a truth lacks is in part background, and shows again.
            truths = [
                one + is_planned * (earlier.background_of(before, shown) @ weighted.background.T)
                for one, before, shown in zip(truths, known, seen, strict=True)
            ]
        nothing = Appearance(np.zeros((rows, 0)), np.zeros(0))
        return cls(
            tuple(rivals),
            tuple(weighted.whitened(one.T).T for one in truths),
            tuple(
                tuple(Appearance.of(*one, weighted) for one in of_rival.items()) or (nothing,)
                for of_rival in parts
            ),
            weighted,
            root,
            is_planned,
            own,
            earlier,
        )

    @property
    def labels(self) -> list[str]:
        """Of the rivals, ``effect@joint`` or ``nothing``."""
        return [sized.rival.label for sized in self.rivals]

    @property
    def _prior(self) -> NDArray:
        """Probability (R,) of each rival if it is one of them."""
        prior = np.array([sized.rival.probability for sized in self.rivals])
        return prior / prior.sum()

    def log_odds(self) -> NDArray:
        """Return the expected log odds of each truth against each rival, (R, R), priors apart.

        The mean over the truth's shapes; of the rival, the shape counts that is most alike.
        Diagnosed runs only add to what the others show.
        """
        return np.array([one.mean(axis=0) for one in self._odds])

    @cached_property
    def _odds(self) -> list[NDArray]:
        """Expected log odds of each size of each truth, (n, R)."""
        earlier = self.earlier._odds if self.earlier else None
        return self._odds_by(Appearance.log_likelihood, earlier)

    @cached_property
    def _free_odds(self) -> list[NDArray]:
        """What T-optimality maximizes: the same where amplitudes are free."""
        earlier = self.earlier._free_odds if self.earlier else None
        return self._odds_by(Appearance.explained, earlier)

    def _odds_by(
        self, fit: Callable[[Appearance, NDArray], NDArray], earlier: list[NDArray] | None
    ) -> list[NDArray]:
        """Return log odds (n, R) of each truth by some fit, without those of earlier runs."""
        result = []
        for i, truths in enumerate(self.truths):
            best = np.array(
                [np.max([fit(one, truths) for one in shapes], axis=0) for shapes in self.shapes]
            ).T
            result.append(best[:, i : i + 1] - best)
        if earlier is None:
            return result
        return [now - before for now, before in zip(result, earlier, strict=True)]

    @cached_property
    def _background_covariance(self) -> NDArray:
        """Of the k sizes of the background, (k, k), after these runs."""
        B = self.problem.background
        return np.linalg.inv(np.eye(B.shape[1]) + B.T @ B)

    def background_of(self, truths: NDArray, seen: NDArray | None) -> NDArray:
        """Return the sizes of the background (n, k) to expect after what these runs showed.

        Parameters
        ----------
        truths : (n, rows) array
            The torque of some truths in these runs, unweighted.
        seen : (rows,) array or None
            What the runs showed; None where it is what each truth makes.
        """
        B = self.problem.background
        if seen is None or not B.size:
            return np.zeros((len(truths), B.shape[1]))
        return (self.root * (seen - truths)) @ B @ self._background_covariance

    def log_loss(self) -> float:
        """Return the expected log loss of the posterior, bounded pair by pair.

        Log odds have the variance of twice their mean. Of each truth the expected logarithms of
        one plus the odds against it are added up, for each rival. What a rival costs is left out.
        """
        nodes, parts = np.polynomial.hermite_e.hermegauss(15)
        parts /= parts.sum()
        prior, loss = self._prior, 0.0
        for i, odds in enumerate(self._free_odds):
            mean = np.maximum(odds, 0.0)[:, :, np.newaxis]
            against = np.log(prior / prior[i])[:, np.newaxis]
            lost = np.logaddexp(0.0, against - mean - np.sqrt(2.0 * mean) * nodes) @ parts
            loss += prior[i] * float(np.delete(lost, i, axis=1).sum(axis=1).mean())
        return loss

    def separable(self) -> NDArray:
        """Return whether each rival leaves a part of each truth unexplained, (R, R).

        A law with another one as a part explains that one in every motion.
        """
        every = range(len(self.rivals))
        shares = [[self._share(i, j) if i != j else 0.0 for j in every] for i in every]
        return np.array(shares) >= NEVER_APART

    def inseparable(self) -> list[Pair]:
        """Return the pairs of rivals of which each explains nearly all of the other's torque."""
        separable = self.separable()
        pairs = itertools.combinations(range(len(self.rivals)), 2)
        return [
            (self.labels[i], self.labels[j])
            for i, j in pairs
            if not (separable[i, j] or separable[j, i])
        ]

    def least(self, counts: NDArray) -> float:
        """Return the least of the expected log odds: the worst pair counts.

        Parameters
        ----------
        counts : (R, R) array
            Which pairs of a truth and a rival count, as ``separable`` returns them.
        """
        return float(np.min(self.log_odds()[counts]))

    def _share(self, i: int, j: int) -> float:
        """Return the largest share of a truth's power that a rival does not explain."""
        shares = (
            min(1.0 - _squared(rival.span.T @ truth) / whole for rival in self.shapes[j])
            for truth in self.truths[i]
            if (whole := _squared(truth)) > 0.0
        )
        return max(shares, default=0.0)

    def as_json(self) -> dict[str, Any]:
        """Return the rivals, the expected log odds, and the posterior to expect."""
        posterior = self._simulated
        return {
            "rivals": [
                {"cause": sized.rival.label, "probability": sized.rival.probability}
                for sized in self.rivals
            ],
            "expected_log_odds": self.log_odds().tolist(),
            "expected_posterior": posterior.mean(axis=1).tolist(),
            "decided": decided(posterior).tolist(),
        }

    def decides(self) -> float:
        """Return the probability that the true rival has ``DECIDED`` afterwards.

        Where the true cause is none of the rivals, nothing can be promised.
        """
        prior = np.array([sized.rival.probability for sized in self.rivals])
        return float(prior @ decided(self._simulated))

    @cached_property
    def _simulated(self) -> NDArray:
        """The posteriors of simulated experiments, as many as are usual."""
        return self.posterior()

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
        prior = np.log(self._prior)
        result = np.zeros((len(self.rivals), draws, len(self.rivals)))
        count = self.problem.background.shape[1]
        unknown = np.eye(count)
        if self.earlier:
            unknown = np.linalg.cholesky(self.earlier._background_covariance)
        for i, own in enumerate(self.truths):
            of_draw = np.arange(draws) % len(own)
            # That the model's form is not exact is noise, too: weighted rows have unit noise.
            y = rng.standard_normal((draws, len(self.root)))
            sizes = rng.standard_normal((draws, len(unknown))) @ unknown.T
            y = self.is_planned * (y + sizes @ self.problem.background.T)
            y = own[of_draw] + self.problem.whitened(y.T).T
            log = self._evidence(y) + prior
            if self.earlier:
                known = self.earlier._evidence(self.earlier.truths[i])
                log -= known[of_draw]
            result[i] = np.exp(log - logsumexp(log, axis=1, keepdims=True))
        return result

    def _evidence(self, y: NDArray) -> NDArray:
        """Return the log likelihood of each rival, (n, R), over its shapes, in rows (n, rows)."""
        of_rivals = [
            logsumexp([one.log_likelihood(y) for one in own], axis=0) - np.log(len(own))
            for own in self.shapes
        ]
        return np.array(of_rivals).T


def _weights(truths: Sequence[NDArray], problem: DetectionProblem) -> NDArray:
    """Return the weight of each output, (O,), by the mean power of all truths there."""
    # The mean over all causes: the rivals stand for one torque.
    powers = [np.mean(one * one, axis=0) for one in truths if one.any()]
    squares = np.mean(powers or [np.zeros(len(problem.outputs))], axis=0)
    explained = np.bincount(problem.outputs, squares, minlength=len(problem.root))
    return power(explained, 1.0, CRITERIA.model_error)


def _seen(
    sized: SizedRival, rivals: Sequence[SizedRival], known: Sequence[NDArray]
) -> NDArray | None:
    """Return what the diagnosed runs showed, (rows,) or, if each truth is as it was seen, None."""
    pairs = list(zip(rivals, known, strict=True))
    fitted = [own for one, own in pairs if one.rival.term]
    if not fitted and sized.rival.effect:
        return None
    # Without a fitted cause, nothing has by chance looked like the first one.
    return (fitted or [own for one, own in pairs if one.rival.effect])[0].mean(axis=0)


def _with_known(
    truths: NDArray,
    known: NDArray,
    seen: NDArray | None,
    root: NDArray,
    weighted: DetectionProblem,
) -> NDArray:
    """Return the rows (n, rows) of some truths, with what diagnosed runs showed.

    Parameters
    ----------
    truths : (n, rows) array
        Their torque, unweighted.
    known : (n, diagnosed) array
        Their torque in the diagnosed runs alone, which are the first rows.
    seen : (diagnosed,) array or None
        What these runs showed; None where it is what each truth makes.
    root : (rows,) array
        Roots of the weights.
    weighted : DetectionProblem
        With these weights.
    """
    # What differs from a truth there is noise, and not a motion of the baseline's parameters.
    rows = truths.copy()
    if seen is not None:
        rows[:, : known.shape[1]] += seen - known
    rows *= root
    return rows - (rows @ weighted.basis) @ weighted.basis.T


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
