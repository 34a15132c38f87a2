"""Detect bursts: knocks at moments of their own, which change a torque at once and then fade.

Differences between adjacent periods hold what does not repeat. A process of first order predicts
each from the one before, and the innovation is the rest. With bursts a few innovations are many
times as large as usual. The evidence is the Bayes factor of such a mixture over noise alone. The
size of noise may change, as with the speed: its innovations then have Student's distribution.
Without periods there is no evidence, as errors of the model at reversals are large and rare too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm, t

from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.slow_error import slowed

FREEDOM = (6.0, 20.0, np.inf)
"""Degrees of freedom of the noise's innovations, equally likely: infinite for Gaussian noise. With
six, the size of the noise varies by a factor of three."""
OFTEN = (0.01, 0.03, 0.1)
"""Shares of innovations with a burst, equally likely: at ten a second, up to one a second."""
LARGER = (4.0, 8.0, 16.0)
"""Sizes of bursts in units of the noise, equally likely."""
SCALES = np.geomspace(0.4, 2.5, 25)
"""Scales of the noise over its robust estimate, equally likely."""
ROBUST = 1.4826
"""Standard deviation of Gaussian noise over its median size."""
FEWEST = 100
"""Fewest innovations that are evidence."""


def bursts(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray:
    """Return the log Bayes factor of bursts at each joint, (J,).

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, drives first, N·m.
    """
    slow = [slowed(run, residual) for run, residual in zip(runs, residuals, strict=True)]
    scattered = [scatter(run, residual) for run, residual in slow]
    joints = range(len(runs[0].motion.joints))
    return np.array([_log_bayes_factor(_innovations([x[:, j] for x in scattered])) for j in joints])


def _innovations(series: Sequence[NDArray]) -> NDArray:
    """Return what a process of first order does not predict of series with gaps as NaN, (n,)."""
    pairs = np.concatenate([np.column_stack([x[:-1], x[1:]]) for x in series])
    before, now = pairs[np.isfinite(pairs).all(axis=1)].T
    power = float(before @ before)
    return np.asarray(now - (before @ now) / power * before) if power > 0.0 else np.zeros(0)


def _log_bayes_factor(innovations: NDArray) -> float:
    """Return the log Bayes factor of bursts from innovations (n,)."""
    usual = ROBUST * float(np.median(np.abs(innovations))) if len(innovations) >= FEWEST else 0.0
    if usual <= 0.0:
        return 0.0
    noise, with_bursts = [], []
    for scale in SCALES * usual:
        x = innovations / scale
        for freedom in FREEDOM:
            density = t.logpdf(x, freedom) - np.log(scale)
            noise.append(density.sum())
            for size in LARGER:
                burst = norm.logpdf(innovations, scale=scale * np.hypot(1.0, size))
                with_bursts += [
                    np.logaddexp(np.log1p(-share) + density, np.log(share) + burst).sum()
                    for share in OFTEN
                ]
    # Neighbouring differences share a period: half of them are independent.
    means = [logsumexp(some, b=1.0 / len(some)) for some in (with_bursts, noise)]
    return 0.5 * float(means[0] - means[1])
