"""Split the baseline's squared error on validation runs into causes, joint by joint.

Mean squares of independent parts add up, root mean squares do not: every share is a mean square,
(N·m)².
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.validation_error import scored


def error_budget(d: Diagnosis) -> dict[str, dict[str, float]]:
    """Return the shares of each joint's mean square error.

    A cause's share, by its label, is below zero at a joint whose error it raises. The others are
    ``noise_floor``, ``repeatable_unexplained`` and ``not_repeatable``; without a period
    ``unexplained`` replaces the last two.

    Parameters
    ----------
    d : Diagnosis
        With residuals on the validation runs.

    Returns
    -------
    dict
        By joint and share, (N·m)²; a joint's shares add up to the square of ``baseline_rmse_nm``.
    """
    remaining = d.after.errors.rms**2
    # The floor is an estimate and may exceed what remains, but shares must add up.
    floor = np.minimum(d.floor_rms**2, remaining)
    causes = shares_of_causes(d.causes, lambda labels: _mean_square(d, labels))
    scatter = scatter_between_periods(d.validate, d.after.residuals)
    budget = {}
    for j, joint in enumerate(d.baseline.joints):
        if joint not in d.baseline.machine.measured_names:
            continue
        shares = {"noise_floor": float(floor[j])} | {
            label: float(share[j]) for label, share in causes.items()
        }
        above = float(remaining[j] - floor[j])
        if scatter is None:
            shares["unexplained"] = above
        else:
            # The scatter is an estimate as well, so the difference may be negative.
            repeats = float(np.clip(remaining[j] - scatter[j], 0.0, above))
            shares |= {"repeatable_unexplained": repeats, "not_repeatable": above - repeats}
        budget[joint] = shares
    return budget


def shares_of_causes(
    labels: Sequence[str], left_by: Callable[[frozenset[str]], NDArray]
) -> dict[str, NDArray]:
    """Return the mean square that each cause removes, averaged over all orders (Shapley 1953).

    Causes overlap: the second of two cannot remove the part that the first removes. The average
    over the orders in which they can be named is fair to both, and adds up.

    Parameters
    ----------
    labels : sequence of str
    left_by : callable
        Returns the mean squares (J,) of the model with a set of causes.

    Returns
    -------
    dict of str to (J,) array
        (N·m)², by label.
    """
    # At most three causes are named, so there are eight sets at most.
    sets = [frozenset(s) for size in range(len(labels) + 1) for s in combinations(labels, size)]
    remaining = {s: left_by(s) for s in sets} if labels else {}
    orders = factorial(len(labels))
    return {
        label: sum(
            (
                # Share of the orders in which exactly the causes of ``s`` come before this one.
                factorial(len(s))
                * factorial(len(labels) - len(s) - 1)
                / orders
                * (remaining[s] - remaining[s | {label}])
                for s in sets
                if label not in s
            ),
            start=np.zeros(1),
        )
        for label in labels
    }


def _mean_square(d: Diagnosis, labels: frozenset[str]) -> NDArray:
    named = frozenset(d.causes)
    if labels == named:
        return d.after.errors.rms**2
    if not labels:
        return d.before.errors.rms**2
    if len(labels) == len(named) - 1:
        return d.without[next(iter(named - labels))].errors.rms ** 2
    # Judging has fitted the sets that lack one cause at most; smaller ones are fitted here.
    return d.scheme.refitted(d.after, labels).errors.rms ** 2


def scatter_between_periods(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray | None:
    """Return the variance of residuals about their means at the same phase.

    It has noise and all that changes from period to period, drift included; the rest of the mean
    square repeats.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        N·m of each run.

    Returns
    -------
    (J,) array or None
        (N·m)²; None without periods.
    """
    squares, freedom = np.zeros(len(runs[0].motion.joints)), 0
    for run, residual in zip(runs, residuals, strict=True):
        if not run.motion.period_s:
            continue
        width = run.block.decimation / run.motion.sample_rate_hz
        chosen = scored(run)
        place = np.round(run.time[chosen] % run.motion.period_s / width).astype(int)
        own = residual[chosen, : len(run.motion.joints)]
        count = np.bincount(place)
        mean = (
            np.stack([np.bincount(place, e) for e in own.T], axis=1)
            / np.maximum(count, 1)[:, np.newaxis]
        )
        squares = squares + np.sum((own - mean[place]) ** 2, axis=0)
        # Each phase spends one degree of freedom on its mean.
        freedom += int(np.sum(np.maximum(count - 1, 0)))
    return squares / freedom if freedom else None
