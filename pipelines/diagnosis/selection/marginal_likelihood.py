"""Compute how well a set of causes and laws explains a session, amplitudes integrated out.

Given shapes everything is linear and Gaussian: y = sum over the set of (A a + D d) + F f + noise,
with A the element's columns, D steps along its shapes and towards another form, and F the
background of a good rig. So the marginal likelihood is a closed form in Gram matrices (Bishop,
2006, Pattern Recognition and Machine Learning, sec. 3.5):

    log p = u' (I + S G S)^-1 u / 2 - log det (I + S G S) / 2,  u = S X'y,  S the prior's sd.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtrs
from scipy.special import log_ndtr, logsumexp

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.evidence import Element, Evidence
from pipelines.diagnosis.selection.prior import FEATURES, features, of_set, weights


class MarginalLikelihood:
    """Weighs sets of elements, the background marginalised."""

    def __init__(
        self,
        evidence: Evidence,
        criteria: Criteria,
        rough_share: float = 0.08,
        widths: Sequence[int] = (3, 6, 12),
    ) -> None:
        """Weight rows, and marginalise the background.

        Parameters
        ----------
        evidence : Evidence
        criteria : Criteria
        rough_share : float, optional
            Prior share with which sets are screened before they are weighed in full.
        widths : sequence of int, optional
            Numbers of columns by which elements are screened together; the last is the most that
            count.
        """
        self.evidence, self.criteria = evidence, criteria
        self._rough_variance, self._widths = rough_share**2, widths
        drives, cuffs = np.split(evidence.explained, 2)
        self.power = np.append(
            power(drives, criteria.drive_weight, criteria.model_error),
            power(cuffs, criteria.cuff_weight, criteria.cuff_model_error),
        )
        # The background is in every set, so it is integrated out once for all of them.
        gram = np.einsum("o,oij->ij", self.power, evidence.gram)
        self.gram, self.right = _without(gram, self.power @ evidence.right, *self._background())
        self.parts = [np.array([*e.columns, *e.derivative], dtype=int) for e in evidence.elements]
        own = [features(e, evidence.auxiliary) for e in evidence.elements]
        self.features = np.array(own).reshape(-1, len(FEATURES))
        self._weights = weights(criteria)
        self.apart = np.array(
            [e.log_prior + _log_odds_of_lines(e, criteria) for e in evidence.elements]
        )

    def _background(self) -> tuple[NDArray, NDArray]:
        background = self.evidence.background
        sd = [
            np.sqrt(self.criteria.background_cause**2 * variance + noise)
            for _, variance, noise in background
        ]
        return np.array([place for place, _, _ in background], dtype=int), np.array(sd)

    def prior(self, chosen: Sequence[int]) -> float:
        """Return the prior log odds of a set against the empty one.

        Parameters
        ----------
        chosen : sequence of int
            Numbers of elements.
        """
        return float(of_set([self.features[i] for i in chosen]) @ self._weights)

    def __call__(self, chosen: Sequence[int]) -> float:
        """Return the log posterior odds of a set against the empty one."""
        return self.log_evidence(chosen) + self.prior(chosen)

    def log_evidence(self, chosen: Sequence[int]) -> float:
        """Return the log Bayes factor of a set against the empty one.

        Parameters
        ----------
        chosen : sequence of int
            Numbers of elements.

        Returns
        -------
        float
            Minus infinity where rounding makes its matrix not positive definite.
        """
        if not chosen:
            return 0.0
        elements = [self.evidence.elements[i] for i in chosen]
        amplitudes = np.array(self.criteria.amplitudes)
        try:
            # Of the mixture over sizes only the nearest is computed: the others add little.
            nearest = [
                amplitudes[np.argmin(np.abs(np.log(amplitudes / size)))]
                for size in self.sizes(chosen)
            ]
            columns = np.concatenate([self.parts[i] for i in chosen])
            variance = np.concatenate(
                [self._variance(e, sd**2) for e, sd in zip(elements, nearest, strict=True)]
            )
            value = self._log_evidence(columns, variance, elements)
        except np.linalg.LinAlgError:
            return -np.inf
        # The sizes are equally likely, so one of them has its share of the prior for each element.
        sized = sum(bool(element.columns) for element in elements)
        return (
            value - sized * float(np.log(len(amplitudes))) + float(self.apart[list(chosen)].sum())
        )

    def _variance(self, element: Element, amplitude: float) -> NDArray:
        """Return the prior variances of an element's columns and derivatives."""
        shapes = np.full(len(element.derivative), self.criteria.shape_sd**2)
        return np.append(amplitude * np.array(element.variance), shapes)

    def sizes(self, chosen: Sequence[int]) -> NDArray:
        """Return the share of torque of each element of a set.

        Parameters
        ----------
        chosen : sequence of int
            Numbers of elements.

        Returns
        -------
        (set,) array
            At least 1e-4, because logarithms of it are taken.
        """
        elements = [self.evidence.elements[i] for i in chosen]
        columns = np.concatenate([self.parts[i] for i in chosen])
        # The widest prior shrinks an estimate least.
        largest = max(self.criteria.amplitudes) ** 2
        variance = np.concatenate([self._variance(e, largest) for e in elements])
        system = self.gram[np.ix_(columns, columns)] + np.diag(1.0 / variance)
        values = np.linalg.solve(system, self.right[columns])
        ends = np.cumsum([0, *(len(self.parts[i]) for i in chosen)])
        own = [values[a : a + len(e.columns)] for a, e in zip(ends[:-1], elements, strict=True)]
        # The columns of a cause are orthonormal, so the norm is its share.
        return np.maximum([np.linalg.norm(v) for v in own], 1e-4)

    def _log_evidence(
        self, columns: NDArray, variance: NDArray, elements: Sequence[Element]
    ) -> float:
        """Return the log Bayes factor of columns with prior variances, signs included."""
        sd = np.sqrt(variance)
        system = self.gram[np.ix_(columns, columns)] * np.outer(sd, sd)
        system[np.diag_indices_from(system)] += 1.0
        lower = np.linalg.cholesky(system)
        u = _forward(lower, sd * self.right[columns])
        value = 0.5 * float(u @ u) - float(np.log(lower.diagonal()).sum())
        at = 0
        for element in elements:
            k = len(element.columns)
            if element.amplitudes:
                value += _log_sign(np.array(element.amplitudes), lower, u, sd, at)
            at += k + len(element.derivative)
        return value + self._log_nonnegative(columns, lower, u, sd)

    def _log_nonnegative(self, columns: NDArray, lower: NDArray, u: NDArray, sd: NDArray) -> float:
        """Return the gain in log Bayes factor because friction and inertia are not negative.

        Their prior is flat but for the sign. The part that causes take over from them is
        subtracted: y = B (b - P a) + A a.
        """
        known = self.evidence.nonnegative
        if known is None:
            return 0.0
        # The values with causes, b - P a, are Gaussian: their mean and variance follow from a's.
        half = _forward(lower, sd[:, np.newaxis] * known.imitation.T[columns])
        variance = known.variance @ (1.0 / self.power)
        values, spread = known.alone - half.T @ u, np.sqrt(variance + np.sum(half**2, axis=0))
        # Relative to the empty set, whose friction or inertia may be negative by noise already.
        return float(np.sum(log_ndtr(values / spread) - log_ndtr(known.alone / np.sqrt(variance))))

    def pairs(self, chosen: Sequence[int]) -> tuple[NDArray, NDArray]:
        """Return all pairs of elements with different labels, and rough log odds.

        Parameters
        ----------
        chosen : sequence of int
            Numbers of elements.

        Returns
        -------
        tuple of arrays
            Pairs (p, 2), and log odds (p,).
        """
        numbers = np.asarray(chosen, dtype=int)
        labels = np.array([self.evidence.elements[i].label for i in numbers])
        one, other = np.triu_indices(len(numbers), 1)
        apart = labels[one] != labels[other]
        one, other = one[apart], other[apart]
        # A few common widths: thousands of small systems are solved at once.
        columns, sd, width = self._padded(numbers)
        odds = np.empty(len(one))
        # Number of sets that are screened at once: bounds the memory.
        chunk = 4000
        for a in self._widths:
            for b in self._widths:
                rows = np.flatnonzero((width[one] == a) & (width[other] == b))
                for start in range(0, len(rows), chunk):
                    some = rows[start : start + chunk]
                    c = np.hstack([columns[one[some], :a], columns[other[some], :b]])
                    s = np.hstack([sd[one[some], :a], sd[other[some], :b]])
                    odds[some] = self._rough(c, s)
        own = self.apart + self.features @ self._weights
        odds += own[numbers[one]] + own[numbers[other]] + self._weights[FEATURES.index("further")]
        return np.column_stack([numbers[one], numbers[other]]), odds

    def _padded(self, chosen: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Return elements' columns and prior sds padded to one width, and their true widths."""
        # A padded column has no prior variance: it adds a row of the unit matrix, and no evidence.
        widest = self._widths[-1]
        columns = np.zeros((len(chosen), widest), dtype=int)
        sd, width = np.zeros((len(chosen), widest)), np.zeros(len(chosen), dtype=int)
        for n, i in enumerate(chosen):
            own = self.parts[i][:widest]
            columns[n, : len(own)] = own
            variance = self._variance(self.evidence.elements[i], self._rough_variance)
            sd[n, : len(own)] = np.sqrt(variance[:widest])
            width[n] = next(w for w in self._widths if w >= len(own))
        return columns, sd, width

    def _rough(self, columns: NDArray, sd: NDArray) -> NDArray:
        """Return log Bayes factors of many sets of columns at once, (sets, c) each."""
        system = self.gram[columns[:, :, np.newaxis], columns[:, np.newaxis, :]]
        system *= sd[:, :, np.newaxis] * sd[:, np.newaxis, :]
        diagonal = np.arange(columns.shape[1])
        system[:, diagonal, diagonal] += 1.0
        u = self.right[columns] * sd
        sign, log_determinant = np.linalg.slogdet(system)
        solved = np.linalg.solve(system, u[:, :, np.newaxis])[:, :, 0]
        odds = 0.5 * (np.sum(solved * u, axis=1) - log_determinant)
        return np.where(sign > 0.0, odds, -np.inf)

    def rough(self, chosen: Sequence[int]) -> float:
        """Return a set's log odds from its first columns alone.

        Parameters
        ----------
        chosen : sequence of int
            Numbers of elements, at least one.
        """
        columns = np.concatenate([self.parts[i] for i in chosen])
        elements = [self.evidence.elements[i] for i in chosen]
        variance = np.concatenate([self._variance(e, self._rough_variance) for e in elements])
        value = self._rough(columns[np.newaxis], np.sqrt(variance)[np.newaxis])[0]
        return float(value) + float(self.apart[list(chosen)].sum()) + self.prior(chosen)

    @cached_property
    def alone(self) -> NDArray:
        """Log odds of each element alone, (elements,)."""
        return np.array([self((i,)) for i in range(len(self.evidence.elements))])


def power(explained: NDArray, weight: float, model_error: float) -> NDArray:
    """Return the weight of each output's likelihood, (o,), less where more is explained.

    The reason is that no form is exact.

    Parameters
    ----------
    explained : (o,) array
        Explained part, squared and in units of the noise.
    weight : float
        Where nothing is explained.
    model_error : float
        Criterion of that name.
    """
    return np.asarray(weight / (1.0 + model_error * weight * explained))


def _without(
    gram: NDArray, right: NDArray, background: NDArray, sd: NDArray
) -> tuple[NDArray, NDArray]:
    """Marginalise background columns with prior sds out of the products."""
    system = gram[np.ix_(background, background)] * np.outer(sd, sd)
    system[np.diag_indices_from(system)] += 1.0
    lower = np.linalg.cholesky(system)
    # Schur's complement: the products of all columns less the part that the background takes.
    X = _forward(lower, gram[background] * sd[:, np.newaxis])
    u = _forward(lower, right[background] * sd)
    return gram - X.T @ X, right - X.T @ u


def _forward(lower: NDArray, right: NDArray) -> NDArray:
    """Solve a lower triangular system by LAPACK directly, as a posterior solves thousands."""
    if not len(lower):
        return right  # LAPACK refuses a system without unknowns
    return np.asarray(dtrtrs(lower, right, lower=1)[0])


def _log_odds_of_lines(element: Element, c: Criteria) -> float:
    """Return how much likelier a cause shows a ripple's or tone's lines than a good rig.

    The amplitudes of a line are Gaussian about zero in both: with the shares of any cause in the
    one, with a small share in the other. A good rig need not have it at all.
    """
    if not element.lines:
        return 0.0
    odds = []
    for ratio, share, phases in element.lines:
        ratio *= c.line_weight
        variance = phases * share**2 / (2.0 * ratio)
        of_cause = [_line(ratio, variance, phases, size) for size in c.amplitudes]
        of_rig = [0.0, _line(ratio, variance, phases, c.background_line)]
        # Sizes are equally likely, and so is a rig with the line and one without.
        odds.append(float(logsumexp(of_cause, b=1.0 / len(of_cause)) - logsumexp(of_rig, b=0.5)))
    # Each further line is as likely of another origin, and then no evidence.
    first, *others = sorted(odds, reverse=True)
    return first + sum(float(logsumexp([0.0, other], b=0.5)) for other in others)


def _line(ratio: float, variance: float, phases: int, share: float) -> float:
    """Return the log Bayes factor of a line with a prior share against none."""
    # Sine and cosine of each phase have half of the squared share each.
    prior = 0.5 * share**2
    return ratio * prior / (prior + variance) - phases * float(np.log1p(prior / variance))


def _log_sign(amplitudes: NDArray, lower: NDArray, u: NDArray, sd: NDArray, at: int) -> float:
    """Return the gain in log evidence because amplitudes (p, k) are not negative.

    The prior is symmetric, so the factor is twice the posterior probability of the sign. For
    several amplitudes it is the product, as if they were independent.
    """
    k = amplitudes.shape[1]
    units = np.zeros((len(u), k))
    units[np.arange(at, at + k), np.arange(k)] = sd[at : at + k]
    half = _forward(lower, units)
    mean, covariance = half.T @ u, half.T @ half
    centre = amplitudes @ mean
    spread = np.sqrt(np.einsum("pi,ij,pj->p", amplitudes, covariance, amplitudes))
    return float(np.sum(log_ndtr(centre / np.maximum(spread, 1e-300)) + np.log(2.0)))
