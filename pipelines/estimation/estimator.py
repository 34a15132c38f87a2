"""The interface of an estimator: values for which the sum of scores is zero.

Every method here solves k equations in k parameters: the sum over all rows of a row's *score* is
zero. For least squares, a score is the row's column vector times its residual; for instrumental
variables, it is the instruments times the residual. The covariance then follows from the scores
alone, and is computed in one place, ``estimated``. It is a sandwich H⁻¹ S H⁻ᵀ of the scores'
derivative with respect to the parameters (H) and the scores' long-run covariance (S).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.long_run import Scores, long_run_covariance
from pipelines.estimation.problem import Problem
from pipelines.estimation.sandwich import sandwich
from pipelines.mechanics.machine import Machine


@dataclass(frozen=True)
class Fit:
    """The values of k fitted parameters, of p in the model, with their scores."""

    values: NDArray
    """(k,) values in SI units."""
    normal: NDArray
    """(k, k) weighted normal matrix, symmetric; collinearity is computed from it."""
    sensitivity: NDArray
    """(k, k) derivative of the values with respect to the sum of scores: H⁻¹."""
    carry: NDArray
    """(k, p) derivative of the values with respect to the held ones; zero for the fitted ones."""
    weights: NDArray
    """(J,) weight of each joint: inverse variance of its residual."""
    scores: Scores
    about: dict[str, Any] = field(default_factory=dict)
    """Details of the method, for the file's metadata."""
    remarks: tuple[str, ...] = ()
    """Remarks for the user, a sentence each."""


@dataclass(frozen=True)
class Estimate(Fit):
    """A fit with its covariance."""

    covariance: NDArray = field(kw_only=True)
    """(k, k), for held values without error."""
    critical: float = field(kw_only=True)
    """Half-width of a 95 % interval in standard errors."""


class Estimator(ABC):
    """A method to fit parameters, as ``exoid identify --method`` names it."""

    name: ClassVar[str]
    short: ClassVar[str] = ""
    """Abbreviation in papers, if there is one; ``--method`` accepts it too."""
    title: ClassVar[str]
    """Name in sentences."""
    masks: ClassVar[bool] = True
    """Whether samples near reversals are left out by default."""

    needs_every_torque: ClassVar[bool] = False
    """Whether it simulates the machine, or constrains all of its bodies."""

    def refuse_unmeasured(self, machine: Machine) -> None:
        """Refuse a machine with a joint whose torque was not measured, if the method needs it.

        Raises
        ------
        InputError
            Names the joints.
        """
        if self.needs_every_torque:
            machine.refuse_unmeasured(f"--method {self.name}", "This method")

    @abstractmethod
    def fit(self, problem: Problem) -> Fit:
        """Fit the parameters.

        Raises
        ------
        NotIdentifiable
            If the motion does not separate them.
        InputError
            If the runs lack data that the method needs.
        """


def estimated(fit: Fit) -> Estimate:
    """Return a fit with the covariance of its values.

    Parameters
    ----------
    fit : Fit
        Values (k,), with the scores of each run.

    Returns
    -------
    Estimate
        With a covariance (k, k) that allows for serial correlation, in products of the parameters'
        units.
    """
    S = long_run_covariance(fit.scores, len(fit.values))
    covariance = sandwich(fit.sensitivity, S.covariance)
    return Estimate(**vars(fit), covariance=covariance, critical=S.critical)


def convergence_remark(settled: bool, after: str) -> tuple[str, ...]:
    """Return a remark on a search that did not converge; empty if it did."""
    return () if settled else (f"did not converge in {after}; do not rely on its values",)


def carry_of(problem: Problem, sensitivity: NDArray, slope: NDArray) -> NDArray:
    """Return the derivative of fitted values with respect to held ones.

    Parameters
    ----------
    problem : Problem
        Which columns are fitted, and which are held.
    sensitivity : (k, k) array
        Derivative of the fitted values with respect to the sum of scores.
    slope : (k, p) array
        Decrease of the sum of scores per unit of each column.

    Returns
    -------
    (k, p) array
        Zero for the fitted columns.
    """
    carry = np.zeros_like(slope)
    # The scores still sum to zero when a held value moves: the implicit function theorem.
    carry[:, problem.of_held] = -sensitivity @ slope[:, problem.of_held]
    return carry
