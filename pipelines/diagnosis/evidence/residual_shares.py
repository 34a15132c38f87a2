"""Split the mean square residual by how it repeats, before any cause is sought.

The excitation is a designed experiment: phases within periods, periods within runs, runs with and
without a person. Products of residuals at the same phase of adjacent periods hold the part that
repeats and no noise. The noise model gives the noise. The rest changes from period to period. This
is a functional analysis of variance (Ramsay and Silverman, 2005, Functional Data Analysis, ch. 13).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import RUNS


@dataclass(frozen=True)
class ResidualShares:
    """Shares of one joint's mean square residual in the decision band; they add up to one."""

    rms_nm: float
    """In the decision band."""
    noise: float
    repeats: float | None
    """With the motion, in every period alike; None without a period."""
    wanders: float | None
    """From period to period; None without a period."""
    between_runs: float
    """Constant within a run, and different from run to run."""
    unsplit: float
    """More than noise, where no period shows whether it repeats; else zero."""
    with_person_only: float | None
    """Part of the repeating share that is present with a person only; None with one kind of run."""


def residual_shares(
    runs: Sequence[Run], residuals: Sequence[NDArray], noise: NoiseModel
) -> list[ResidualShares]:
    """Split the mean square residual of each joint.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.
    noise : NoiseModel

    Returns
    -------
    list of ResidualShares
        One for each joint.
    """
    bands = [DecisionBand.of(run) for run in runs]
    averaged = [band.average(r) for band, r in zip(bands, residuals, strict=True)]
    joints = len(runs[0].motion.joints)
    return [_of_joint(j, bands, averaged, noise) for j in range(joints)]


def _of_joint(
    j: int, bands: Sequence[DecisionBand], averaged: Sequence[NDArray], noise: NoiseModel
) -> ResidualShares:
    known = [band.weight[:, j] > 0.0 for band in bands]
    values = [a[k, j] for a, k in zip(averaged, known, strict=True)]
    everything = np.concatenate(values)
    total = float(np.mean(everything**2)) if len(everything) else 0.0
    if not total > 0.0:
        return ResidualShares(0.0, 1.0, None, None, 0.0, 0.0, None)
    # The noise is an estimate of its own, and may exceed the error that it is a part of.
    noisy = min(float(np.nan_to_num(noise.averaged(LENGTH_S)[0][j])) ** 2, total)
    means = np.array([v.mean() if len(v) else 0.0 for v in values])
    counts = np.array([len(v) for v in values])
    grand = float(means @ counts) / counts.sum()
    between = float(counts @ (means - grand) ** 2) / counts.sum()
    repeated = [
        _repeating(band, a[:, j], k) for band, a, k in zip(bands, averaged, known, strict=True)
    ]
    products = np.concatenate(repeated)
    above = max(total - noisy, 0.0)
    # Without a period nothing shows whether the excess repeats, so it stays unsplit.
    if not len(products):
        between = min(between, above)
        return ResidualShares(
            np.sqrt(total),
            noisy / total,
            None,
            None,
            between / total,
            (above - between) / total,
            None,
        )
    repeats = float(np.clip(products.mean(), 0.0, above))
    # A constant of one run repeats in all of its periods, so it is subtracted from that share.
    between = min(between, repeats)
    return ResidualShares(
        np.sqrt(total),
        noisy / total,
        (repeats - between) / total,
        (above - repeats) / total,
        between / total,
        0.0,
        _with_person_only(bands, repeated, total),
    )


def _repeating(band: DecisionBand, values: NDArray, known: NDArray) -> NDArray:
    """Return products of values (M,) at the same phase of adjacent periods, (k,)."""
    period = band.run.motion.period_s
    if not period:
        return np.zeros(0)
    time = band.time
    ahead = np.searchsorted(time, time + period - 0.5 * LENGTH_S)
    inside = ahead < len(time)
    now, later = np.flatnonzero(inside), ahead[inside]
    # A period need not be a whole number of averages: half of one is near enough in phase.
    same = np.abs(time[later] - time[now] - period) <= 0.5 * LENGTH_S
    use = same & known[now] & known[later]
    return values[now[use]] * values[later[use]]


def _with_person_only(
    bands: Sequence[DecisionBand], repeated: Sequence[NDArray], total: float
) -> float | None:
    """Return how much more repeats with a person than without, as a share of all."""
    products = []
    for kind in RUNS:
        own = [r for band, r in zip(bands, repeated, strict=True) if band.run.motion.run == kind]
        products.append(np.concatenate([*own, []]))
    if not all(map(len, products)):
        return None
    # Noise can make a mean of products negative; a power is not.
    alone, worn = (max(float(of_kind.mean()), 0.0) for of_kind in products)
    # The difference exists in the runs with a person only, and they are a part of the total.
    share = len(products[1]) / sum(map(len, repeated))
    return float(np.clip((worn - alone) * share / total, 0.0, 1.0))
