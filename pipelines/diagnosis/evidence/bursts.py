"""Detect bursts: knocks at random times, which change a torque at once and then fade.

Differences between adjacent periods hold what does not repeat. A process of first order predicts
each from the one before, and the innovation is the rest. With bursts a few innovations are many
times as large as usual. The evidence is the Bayes factor of such a mixture over noise alone. The
size of noise may change, as with the speed: its innovations then have Student's distribution.

A wearer may push now and then, and a push passes the cuffs. So what the cuffs measure is
subtracted, and a run with a person and without cuffs is no evidence. Nor is one without periods, as
errors of the model at reversals are large and rare too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm, t

from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.slow_error import slowed


def bursts(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray:
    """Return the log Bayes factor of bursts at each joint, (J,).

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, drives first, N·m.
    """
    joints = len(runs[0].motion.joints)
    parts: list[list[NDArray]] = [[] for _ in range(joints)]
    for run, residual in zip(runs, residuals, strict=True):
        with_person = run.motion.run == "with_human"
        if with_person and not run.has_cuffs:
            continue
        scattered = scatter(*slowed(run, residual))
        drives = scattered[:, :joints]
        # A push on the limb reaches the drive undiminished.
        own = drives - scattered[:, joints : 2 * joints] if with_person else drives
        for j in range(joints):
            parts[j].append(_innovations(own[:, j]))
    return np.array([_log_bayes_factor(np.concatenate([*some, []])) for some in parts])


def _innovations(series: NDArray) -> NDArray:
    """Return what a process of first order does not predict, in units of its usual size, (n,).

    The series (k,) of one run has gaps as NaN. Each run has noise of its own.
    """
    before, now = series[:-1], series[1:]
    known = np.isfinite(before) & np.isfinite(now)
    before, now = before[known], now[known]
    power = float(before @ before)
    # Fewest innovations of a run that are evidence.
    fewest = 100
    if len(now) < fewest or power == 0.0:
        return np.zeros(0)
    innovations = now - (before @ now) / power * before
    # Standard deviation of Gaussian noise over its median size.
    robust = 1.4826
    usual = robust * float(np.median(np.abs(innovations)))
    return innovations / usual if usual > 0.0 else np.zeros(0)


def _log_bayes_factor(innovations: NDArray) -> float:
    """Return the log Bayes factor of bursts from innovations (n,) in units of their usual size."""
    if not len(innovations):
        return 0.0
    noise, with_bursts = [], []
    # Degrees of freedom of the noise's innovations, equally likely: infinite for Gaussian noise.
    # With six, the size of the noise varies by a factor of three.
    freedoms = (6.0, 20.0, np.inf)
    # Shares of innovations with a burst, equally likely: at ten a second, from one in 100 s to
    # one a second.
    shares = (0.001, 0.003, 0.01, 0.03, 0.1)
    # Sizes of bursts in units of the noise, equally likely.
    sizes = (4.0, 8.0, 16.0)
    # Scales of the noise over its robust estimate, equally likely.
    scales = np.geomspace(0.4, 2.5, 25)
    for scale in scales:
        larger = [norm.logpdf(innovations, scale=scale * np.hypot(1.0, size)) for size in sizes]
        for freedom in freedoms:
            density = t.logpdf(innovations / scale, freedom) - np.log(scale)
            noise.append(density.sum())
            with_bursts += [
                np.logaddexp(np.log1p(-share) + density, np.log(share) + burst).sum()
                for burst in larger
                for share in shares
            ]
    means = [logsumexp(some, b=1.0 / len(some)) for some in (with_bursts, noise)]
    # Neighbouring differences share a period: half of them are independent.
    return 0.5 * float(means[0] - means[1])
