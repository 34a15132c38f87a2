"""The Durbin-Wu-Hausman test of whether two estimators agree.

Least squares and instrumental variables have the same limit unless the regressor correlates with
the residual, as it does with noise in the angles. While the limits agree, the difference over its
own covariance is no larger than chance (Hausman, 1978, Econometrica 46(6); for robots Janot,
Vandanjon and Gautier, 2014, Proc. ICRA). That covariance is the long-run one of the difference of
both influence functions, so autocorrelated noise raises no alarm; its own uncertainty is allowed
for as in Hotelling's T². Where it is nearly singular, only those combinations of parameters are
tested in which the estimators can differ, as with Hausman's generalized inverse.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from pipelines.estimation.estimator import Fit
from pipelines.estimation.long_run import long_run_covariance


@dataclass(frozen=True)
class DurbinWuHausman:
    """Result of the test of whether two estimators differ."""

    difference: NDArray
    """(k,) the first's values less the second's."""
    std_error: NDArray
    """(k,) of the difference."""
    statistic: float
    """F statistic."""
    freedom: tuple[float, float]
    """Degrees of freedom of F."""
    p_value: float

    @property
    def rejects(self) -> bool:
        """Whether the estimators differ at a significance level of 5 %."""
        return self.p_value < 0.05

    def as_json(self) -> dict[str, Any]:
        """Return the test for a file's metadata.

        Returns
        -------
        dict
            Lists and numbers under ``statistic``, ``degrees_of_freedom``, ``p_value``,
            ``difference`` and ``std_error``.
        """
        return {
            "statistic": self.statistic,
            "degrees_of_freedom": list(self.freedom),
            "p_value": self.p_value,
            "difference": self.difference.tolist(),
            "std_error": self.std_error.tolist(),
        }


def durbin_wu_hausman(one: Fit, other: Fit) -> DurbinWuHausman:
    """Test whether two fits of the same rows differ by more than chance.

    Parameters
    ----------
    one, other : Fit
        Fits of the same k parameters, with scores of the same runs in the same order.

    Returns
    -------
    DurbinWuHausman
        Differences (k,), ``one`` less ``other``, in the parameters' units, and an F statistic with
        its p-value.
    """
    # Variance below which a combination of parameters is not tested, where each parameter scaled by
    # its error has a mean variance of 1. Below it, second-order errors exceed the difference, and
    # the covariance counts them twice.
    faint = 0.1

    def influences() -> Iterator[tuple[Hashable, NDArray]]:
        for (name, ours), (_, theirs) in zip(one.scores(), other.scores(), strict=True):
            # Each block's influence on the difference: noise that both fits share cancels.
            yield name, ours @ one.sensitivity.T - theirs @ other.sensitivity.T

    difference = one.values - other.values
    V, _, freedom = long_run_covariance(influences, len(difference))
    error = np.sqrt(np.diag(V))
    # In units of the errors, because parameters of different units have no common scale.
    variance, directions = np.linalg.eigh(V / np.outer(error, error))
    informed = variance > faint
    projected = directions.T[informed] @ (difference / error)
    square = float(np.sum(projected**2 / variance[informed]))
    k = int(informed.sum())
    # With an estimated covariance the statistic is Hotelling's T², which this turns into F.
    # A very long lag leaves fewer degrees of freedom than combinations; F needs at least one.
    rest = max(freedom - k + 1.0, 1.0)
    statistic = square * rest / (freedom * k)
    return DurbinWuHausman(
        difference, error, statistic, (float(k), rest), float(fdtrc(k, rest, statistic))
    )
