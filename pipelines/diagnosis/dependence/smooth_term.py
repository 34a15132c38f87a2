"""Extend a model whose cause is unknown: a smooth surface in place of an equation.

The surface is over the one or two variables that predict most of a joint's residual on folds it was
not fitted to, with the shrinkage that predicts best. Where nothing predicts enough, there is no
surface.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.dependence.explained_share import (
    VARIABLES,
    Variable,
    by_kind,
    parts_of_period,
    pooled,
)
from pipelines.diagnosis.dependence.smooth_curve import Curve, fold_products, held_out_error
from pipelines.diagnosis.evidence.observed_run import Run


@dataclass(frozen=True)
class Surface:
    """A curve or surface of one joint's torque in some kinds of run."""

    joint: str
    runs: tuple[str, ...]
    curve: Curve
    values: NDArray
    share: float
    """Of the residual's square, predicted on folds that were not fitted."""


@dataclass(frozen=True)
class SmoothTerm:
    """The surfaces that predict enough."""

    surfaces: tuple[Surface, ...]

    def torque(self, run: Run) -> NDArray:
        """Return the surfaces' torque at each output.

        Parameters
        ----------
        run : Run
            m blocks of O outputs.

        Returns
        -------
        (m, O) array
            N·m.
        """
        torque = np.zeros_like(run.measured)
        for surface in self.surfaces:
            if run.motion.run in surface.runs:
                torque[:, surface.curve.joint] += surface.curve.design(run) @ surface.values
        return torque

    def describe(self) -> str:
        """Return the variables of the surfaces in words."""
        parts = []
        for surface in self.surfaces:
            names = " and ".join(v.name.replace("_", " ") for v in surface.curve.variables)
            where = f"{surface.joint}, {' and '.join(surface.runs)}"
            parts.append(f"{where}: {names} ({100 * surface.share:.0f} % of the remaining error)")
        return "; ".join(parts) or "no smooth term predicts enough"


def smooth_term(runs: Sequence[Run], residuals: Sequence[NDArray]) -> SmoothTerm:
    """Fit surfaces to the residuals of training runs, joint by joint.

    With both kinds of run a law must predict one kind from the other, or act in the one with most
    of the error.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    SmoothTerm
    """
    joints = runs[0].motion.machine.measured_indices
    terms = [_of_joint(runs, [r[:, j] for r in residuals], j) for j in joints]
    return SmoothTerm(tuple(surface for surface in terms if surface is not None))


def _of_joint(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> Surface | None:
    surface, kinds = _best(runs, residuals, j), list(by_kind(runs, residuals))
    if surface is not None or len(kinds) == 1:
        return surface
    # No law serves both kinds of run: it may still act in the kind with most of the error.
    squares = [float(np.mean(pooled(*of_kind, j) ** 2)) for of_kind in kinds]
    # Ratio of mean squares from which a law may act in one kind of run only.
    one_sided = 2.0
    if max(squares) < one_sided * min(squares):
        return None
    return _best(*kinds[squares.index(max(squares))], j)


def _best(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> Surface | None:
    # Time and phase are left out: another run, of another motion, must obey the law.
    known = [v for v in VARIABLES if v.lasting and all(v.of(run, j) is not None for run in runs)]
    one = max((_surface([v], runs, residuals, j) for v in known), key=lambda s: s.share)
    two = max(
        (_surface(p, runs, residuals, j) for p in itertools.combinations(known, 2)),
        key=lambda s: s.share,
    )
    # Share by which two variables must predict more than one.
    better = 0.05
    best = two if two.share > one.share + better else one
    # Least share of a residual's square that a surface must predict.
    least_share = 0.05
    return best if best.share > least_share else None


def _surface(
    variables: Sequence[Variable], runs: Sequence[Run], residuals: Sequence[NDArray], j: int
) -> Surface:
    curve = Curve.along(variables, runs, j)
    kinds = list(dict.fromkeys(run.motion.run for run in runs))
    y, design = pooled(runs, residuals, j), pooled(runs, [curve.design(run) for run in runs], j)
    partitions = [[run.fold for run in runs], [parts_of_period(run) for run in runs]]
    # A law of the machine must predict the runs with a wearer from those without.
    if len(kinds) > 1:
        partitions.append([np.full(len(run.time), kinds.index(run.motion.run)) for run in runs])
    products = fold_products(design, y, [pooled(runs, folds, j) for folds in partitions])
    error, ridge = held_out_error(products)
    # All folds of a partition together are all rows, so any partition gives the same values.
    values, share = products[0].fitted(ridge), 1.0 - error / float(y @ y)
    return Surface(runs[0].motion.joints[j], tuple(kinds), curve, values, share)
