"""The test of Durbin, Wu and Hausman: whether two estimators that agree on good data agree on
these.

Least squares and instrumental variables have the same limit unless what stands in the regressor,
the angles, goes with what the fit leaves: noise in the angles. Their difference over its own
covariance then is no larger than chance (Hausman, 1978, Econometrica 46(6); for robots Janot,
Vandanjon and Gautier, 2014, Proc. ICRA). That covariance is the long-run one of the difference of
both influence functions, so autocorrelated noise raises no alarm; what it is uncertain itself is
allowed for as in Hotelling's T². Where it is nearly singular, only those combinations of parameters
are judged in which the estimators can differ, as with Hausman's generalized inverse.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from pipelines.estimation.estimator import Fit
from pipelines.estimation.long_run import long_run_covariance

LEVEL = 0.05
FAINT = 0.1
"""Variance, of a mean of 1 once each parameter is scaled by its error, below which a combination of
parameters is not judged: so little differs there that errors of second order outdo it, which the
covariance counts twice."""


@dataclass(frozen=True)
class DurbinWuHausman:
    """How sure it is that two estimators differ."""

    difference: NDArray
    """(k,) the first's values less the second's."""
    std_error: NDArray
    """(k,) of the difference."""
    statistic: float
    """F."""
    freedom: tuple[float, float]
    """Degrees of freedom of F."""
    p_value: float

    @property
    def rejects(self) -> bool:
        """Tell whether the estimators differ by more than chance makes them in 19 of 20
        sessions."""
        return self.p_value < LEVEL

    def as_json(self) -> dict[str, Any]:
        """Return what a file's metadata say of it."""
        return {
            "statistic": self.statistic,
            "degrees_of_freedom": list(self.freedom),
            "p_value": self.p_value,
            "difference": self.difference.tolist(),
            "std_error": self.std_error.tolist(),
        }


def durbin_wu_hausman(one: Fit, other: Fit) -> DurbinWuHausman:
    """Compare two fits of the same parameters to the same rows."""

    def influences() -> Iterator[tuple[Hashable, NDArray]]:
        for (name, ours), (_, theirs) in zip(one.scores(), other.scores(), strict=True):
            yield name, ours @ one.sensitivity.T - theirs @ other.sensitivity.T

    difference = one.values - other.values
    V, _, freedom = long_run_covariance(influences, len(difference))
    error = np.sqrt(np.diag(V))
    variance, directions = np.linalg.eigh(V / np.outer(error, error))
    informed = variance > FAINT
    square = float(
        np.sum((directions.T[informed] @ (difference / error)) ** 2 / variance[informed])
    )
    k = int(informed.sum())
    rest = max(freedom - k + 1.0, 1.0)
    statistic = square * rest / (freedom * k)
    return DurbinWuHausman(
        difference, error, statistic, (float(k), rest), float(f.sf(statistic, k, rest))
    )
