"""Impacts: bursts of 4 to 25 Hz where the load changes sign, as teeth make that cross their play.

How the parts bounce no model foretells, so what play does is not found in the mean of the torque alone but in
where its scatter is large. The evidence is the log likelihood that two variances, one where the load has just
changed sign and one elsewhere, gain over a single one.

What goes smoothly with the motion is no burst, however fast the motion makes it: an eccentric encoder's error swings at
harmonics of the motion, and may be large where the load changes sign. So bursts must be there with and without a smooth
law of the motion taken off: what the law leaves may look like one, too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.noise_floor import faster
from pipelines.diagnosis.evidence.observed_run import Run

SLOW_S = 0.2
"""Averages over this hold what is no burst."""
BEFORE_S, AFTER_S = 0.05, 0.35
"""About a change of sign: the load is an estimate, and what it strikes rings for a few swings."""
LOUDER = 1.25
"""Ratio of variances from which there is a burst at all: friction that changes with the load makes some scatter too."""
FEWEST = 30
"""Blocks of each kind that a variance is told from."""
DEGREE = 4
"""Of the polynomials in a joint's angle that are the coefficients of a smooth law."""
BLOCKS_EACH = 20
"""Usable blocks for each parameter of the law: fitted to fewer it would take bursts for its own."""
RANK = 1e-6
"""Relative size below which a combination of the law's terms is none."""


def evidence_of_play(runs: Sequence[Run], residuals: Sequence[NDArray], independent_share: float) -> NDArray:
    """Return the log likelihood that play gains at each joint, (J,), by bursts that no smooth law of the motion is.

    Parameters
    ----------
    runs : with loads estimated
    residuals : (m, O) of each run under the baseline
    independent_share : of samples
    """
    return np.array([independent_share * _bursts(runs, residuals, j) for j in range(len(runs[0].motion.joints))])


def _bursts(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> float:
    """Return the log likelihood of bursts at one joint, with and without a smooth law of the motion: the smaller."""
    as_it_is = _louder(runs, residuals, j)
    return min(as_it_is, _louder(runs, _less_smooth_law(runs, residuals, j), j)) if as_it_is > 0.0 else 0.0


def _louder(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> float:
    """Return the log likelihood that two variances gain at one joint were all samples independent."""
    parts = [_squares(run, residual, j) for run, residual in zip(runs, residuals, strict=True)]
    near, far = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    if min(len(near), len(far)) < FEWEST or not near.mean() > LOUDER * far.mean() > 0:
        return 0.0
    both = np.concatenate([near, far])
    return 0.5 * float(sum(sign * len(x) * np.log(x.mean()) for sign, x in ((1, both), (-1, near), (-1, far))))


def _less_smooth_law(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> list[NDArray]:
    """Return residuals (m, O) less what a smooth law of the motion tells of one joint's; as they are in short runs."""
    usable = [run.usable[:, j] for run in runs]
    known = np.concatenate([run.state[0][u, j] for run, u in zip(runs, usable, strict=True)])
    low, high = known.min(), known.max()
    if not high > low:
        return list(residuals)
    designs = [_smooth_law(run, j, low, high) for run in runs]
    A = np.concatenate([design[u] for design, u in zip(designs, usable, strict=True)])
    b = np.concatenate([residual[u, j] for residual, u in zip(residuals, usable, strict=True)])
    if len(b) < BLOCKS_EACH * A.shape[1]:
        return list(residuals)
    size = np.linalg.norm(A, axis=0)
    size[size == 0.0] = 1.0
    values = np.linalg.lstsq(A / size, b, rcond=RANK)[0] / size
    left = [residual.copy() for residual in residuals]
    for rest, design in zip(left, designs, strict=True):
        rest[:, j] -= design @ values
    return left


def _smooth_law(run: Run, j: int, low: float, high: float) -> NDArray:
    """Return what a smooth law's parameters do, (m, p): polynomials in a joint's angle times what inertia,
    centrifugal torque, friction and another joint's motion go with."""
    q, dq, ddq = run.state
    here = dq[:, j]
    others = [x for k in range(q.shape[1]) if k != j for x in (ddq[:, k], dq[:, k] ** 2)]
    terms = np.column_stack([np.ones(len(q)), here, here**2, np.sign(here), ddq[:, j], *others])
    polynomials = legvander(2.0 * (q[:, j] - low) / (high - low) - 1.0, DEGREE)
    return np.asarray((terms[:, :, np.newaxis] * polynomials[:, np.newaxis, :]).reshape(len(q), -1))


def _squares(run: Run, residual: NDArray, j: int) -> tuple[NDArray, NDArray]:
    """Return the squares of what is fast in a residual (m, O) at one joint, near changes of the load's sign and off."""
    assert run.motion.load is not None, "bursts are sought where the load is known"
    spacing = run.block.decimation / run.motion.sample_rate_hz
    fast = faster(run, residual, SLOW_S)[:, j]
    usable = ~np.isnan(fast)
    positive = run.average(run.motion.load)[:, j] > 0
    near = np.zeros(len(residual), dtype=bool)
    for at in np.flatnonzero(np.diff(positive)):
        near[max(0, at - round(BEFORE_S / spacing)) : at + round(AFTER_S / spacing)] = True
    return fast[near & usable] ** 2, fast[~near & usable] ** 2
