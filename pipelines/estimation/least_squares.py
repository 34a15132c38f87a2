"""Weighted least squares over several runs, its covariance honest about autocorrelation.

Rows that come piece by piece are compressed as they pass into as many rows as there are columns
(Golub and Van Loan, Matrix Computations, 5.3; the triangles of pieces are stacked and made one triangle again, as
in Demmel et al., 2012, SIAM J. Sci. Comput. 34(1)): residuals of any fit have the same square sum in both, and no
digits are lost to squaring. The covariance is a sandwich whose filling is the long-run covariance of the scores.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from pipelines.errors import NotIdentifiable
from pipelines.estimation.collinearity import worst_direction
from pipelines.estimation.long_run import Scores, long_run_covariance
from pipelines.estimation.regression import Regression

PASSES = 3
"""Of reweighting: each joint's weight is the inverse of its residual's variance."""
SINGULAR = 1e7
"""Condition number of the scaled regressor beyond which rounding decides."""


@dataclass(frozen=True)
class Compressed:
    """All usable rows of some runs in few, r for each of J joints: ``torque = regressor @ parameters + noise``."""

    regressor: NDArray
    """(J, r, p)."""
    torque: NDArray
    """(J, r) N·m."""
    count: NDArray
    """(J,) how many rows there were."""

    def select(self, columns: NDArray) -> "Compressed":
        """Return the regression on some of the parameters."""
        return replace(self, regressor=self.regressor[:, :, columns])

    def with_held(self, columns: NDArray, values: NDArray) -> "Compressed":
        """Return the same rows, less the torque of parameters whose values are known."""
        return replace(self, torque=self.torque - self.regressor[:, :, columns] @ values)

    def spread(self, columns: NDArray, parameters: int) -> "Compressed":
        """Return the rows in a model of more parameters, in which these have the numbers ``columns``."""
        regressor = np.zeros((*self.torque.shape, parameters))
        regressor[:, :, columns] = self.regressor
        return replace(self, regressor=regressor)


def compress(regressions: Iterable[Regression]) -> Compressed:
    """Compress the usable rows of all pieces of some runs."""
    triangles: list[NDArray] = []
    count: NDArray | int = 0
    for r in regressions:
        rows = np.concatenate([r.regressor, r.torque[:, :, np.newaxis]], axis=2)
        triangles = triangles or [np.zeros((0, rows.shape[2]))] * rows.shape[1]
        for j, triangle in enumerate(triangles):
            triangles[j] = qr(np.concatenate([triangle, rows[r.usable[:, j], j]]), mode="r")[0][: rows.shape[2]]
        count = count + r.usable.sum(axis=0)
    # Few usable rows make fewer rows than columns; zeros say nothing, and all joints have as many.
    width = triangles[0].shape[1]
    stacked = np.stack([np.pad(t, ((0, width - len(t)), (0, 0))) for t in triangles])
    return Compressed(stacked[:, :, :-1], stacked[:, :, -1], np.asarray(count))


def together(parts: Sequence[Compressed]) -> Compressed:
    """Return the rows of several as one."""
    return Compressed(
        np.concatenate([part.regressor for part in parts], axis=1),
        np.concatenate([part.torque for part in parts], axis=1),
        np.sum([part.count for part in parts], axis=0),
    )


@dataclass(frozen=True)
class Fit:
    """Parameters that leave the least of the torque, and how."""

    values: NDArray
    """(p,)."""
    residual_rms: NDArray
    """(J,) N·m over usable rows."""
    sensitivity: NDArray
    """(p, p) inverse of the normal matrix."""
    weights: NDArray
    """(J,) 1/(N·m)²."""


@dataclass(frozen=True)
class Estimate(Fit):
    """A fit, and how far to trust it."""

    covariance: NDArray
    """(p, p)."""
    critical: float
    """Half-width of a 95 % interval in standard errors."""


def normal_equations(rows: Compressed, weights: NDArray) -> tuple[NDArray, NDArray]:
    """Return A'WA (p, p) and A'W tau (p,) over all usable rows."""
    gram = np.einsum("j,jri,jrk->ik", weights, rows.regressor, rows.regressor)
    return gram, np.einsum("j,jri,jr->i", weights, rows.regressor, rows.torque)


def residual_of(r: Regression, values: NDArray) -> NDArray:
    """Return measured less predicted torque, (m, J) N·m."""
    return r.torque - r.regressor @ values


def solve(rows: Compressed, names: Sequence[str]) -> Fit:
    """Fit ``torque = regressor @ values`` to all runs at once.

    ``names`` label the columns in the error that is raised when the motion cannot separate them.
    """
    weights = np.ones(len(rows.count))
    for _ in range(PASSES):
        gram, right = normal_equations(rows, weights)
        values = _inverse(gram, names) @ right
        # A perfect fit would weigh infinitely; below a micronewton-metre there is nothing to balance.
        weights = 1.0 / np.maximum(residual_rms(rows, values), 1e-6) ** 2
    gram, right = normal_equations(rows, weights)
    inverse = _inverse(gram, names)
    values = inverse @ right
    return Fit(values, residual_rms(rows, values), inverse, weights)


def residual_rms(rows: Compressed, values: NDArray) -> NDArray:
    """Return the root mean square residual of each joint over usable rows, (J,) N·m."""
    residual = rows.torque - rows.regressor @ values
    return np.sqrt(np.sum(residual**2, axis=1) / np.maximum(rows.count, 1))


def estimate(fit: Fit, scores: Scores) -> Estimate:
    """Return a fit with the covariance that its scores tell."""
    filling, critical = long_run_covariance(scores, len(fit.values))
    return Estimate(**vars(fit), covariance=fit.sensitivity @ filling @ fit.sensitivity, critical=critical)


def score(r: Regression, values: NDArray, weights: NDArray, columns: NDArray) -> Iterator[tuple[int, NDArray]]:
    """Yield each segment's number and scores (m, p): what every block adds to the normal equations' residual.

    ``values`` are those of all columns; the scores are of the fitted ``columns``.
    """
    residual = np.where(r.usable, residual_of(r, values), 0.0)
    scores = np.einsum("mj,mjp,j->mp", residual, r.regressor[:, :, columns], weights)
    begins = np.flatnonzero(np.diff(r.segment)) + 1
    for rows in np.split(np.arange(len(scores)), begins):
        if len(rows):
            yield int(r.segment[rows[0]]), scores[rows]


def _inverse(gram: NDArray, names: Sequence[str]) -> NDArray:
    size = np.sqrt(np.diag(gram))
    if not np.all(size > 0):
        silent = [name for name, s in zip(names, size, strict=True) if s == 0]
        raise NotIdentifiable(
            f"the motion does not excite {', '.join(silent)} at all: their columns are zero on every usable sample; "
            "move every joint, in both directions, faster than it sticks"
        )
    scaled = gram / np.outer(size, size)
    eigenvalues = np.linalg.eigvalsh(scaled)
    if eigenvalues[0] <= 0 or np.sqrt(eigenvalues[-1] / eigenvalues[0]) > SINGULAR:
        mixed = worst_direction(scaled, names)
        raise NotIdentifiable(
            f"the motion does not separate {' and '.join(mixed)}: any of them can stand for the others; "
            "excite more harmonics and both joints at once, or lengthen the run"
        )
    return np.linalg.inv(scaled) / np.outer(size, size)
