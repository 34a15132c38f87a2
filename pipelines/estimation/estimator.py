"""The interface of an estimator: it makes the sum of scores zero, and says what scores.

Every method here solves k equations in k parameters: the sum over all rows of a row's *score* is
zero. For least squares a score is the row's column vector times its residual, for instrumental
variables the instruments times it, and so on. Its covariance then follows from the scores alone and
is computed in one place, ``estimated``: a sandwich H⁻¹ S H⁻ᵀ of how the sum changes with the
parameters (H) and the scores' long-run covariance (S).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.long_run import Scores, long_run_covariance
from pipelines.estimation.problem import Problem


@dataclass(frozen=True)
class Fit:
    """What an estimator found: k fitted parameters of p."""

    values: NDArray
    """(k,)."""
    normal: NDArray
    """(k, k) weighted normal matrix, symmetric: what collinearity is read from."""
    sensitivity: NDArray
    """(k, k) how the values answer to the sum of scores: H⁻¹."""
    carry: NDArray
    """(k, p) how the values answer to those that are held; zero for the fitted ones."""
    weights: NDArray
    """(J,) of the joints: inverse variance of what is left there."""
    scores: Scores
    about: dict[str, Any] = field(default_factory=dict)
    """What the method says of itself, for the file's metadata."""
    remarks: tuple[str, ...] = ()
    """What the user should know, a sentence each."""


@dataclass(frozen=True)
class Estimate(Fit):
    """A fit, and how far to trust it."""

    covariance: NDArray = field(kw_only=True)
    """(k, k), the held values taken for certain."""
    critical: float = field(kw_only=True)
    """Half-width of a 95 % interval in standard errors."""


class Estimator(ABC):
    """A method to fit parameters, as ``exoid identify --method`` names it."""

    name: ClassVar[str]
    short: ClassVar[str] = ""
    """What papers call it for short, where they do: ``--method`` takes that too."""
    title: ClassVar[str]
    """In the words of a sentence."""
    masks: ClassVar[bool] = True
    """Whether it leaves out samples near reversals, where not told otherwise."""

    @abstractmethod
    def fit(self, problem: Problem) -> Fit:
        """Fit the parameters.

        Raises
        ------
        NotIdentifiable
            Where the motion cannot separate them.
        InputError
            Where the runs lack what the method needs.
        """


def estimated(fit: Fit) -> Estimate:
    """Return a fit with the covariance that its scores tell."""
    S = long_run_covariance(fit.scores, len(fit.values))
    covariance = fit.sensitivity @ S.covariance @ fit.sensitivity.T
    return Estimate(**vars(fit), covariance=covariance, critical=S.critical)


def distrust(settled: bool, after: str) -> tuple[str, ...]:
    """Return what to say of a search that went on for so long: nothing where it settled."""
    return () if settled else (f"did not settle in {after}; distrust its values",)


def carry_of(problem: Problem, sensitivity: NDArray, slope: NDArray) -> NDArray:
    """Return how fitted values answer to held ones, (k, p): the sum of scores falls by ``slope``
    (k, p) per unit."""
    carry = np.zeros_like(slope)
    carry[:, problem.of_held] = -sensitivity @ slope[:, problem.of_held]
    return carry
