"""Why torque and regressor go through one filter, and reversals are left out: what a faultless fit
leaves otherwise.

``pytest -s tests/identification/test_regression_filter.py`` prints the ratios that
docs/identification.md quotes.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.estimation.regression import away_from_reversals, block_average
from pipelines.model import Model, baseline
from pipelines.signals.low_pass import low_pass

NOISE = np.array([0.6, 0.4])
"""rms of the torque's noise, hip and knee, N·m; correlated over 20 ms."""


def coloured(samples, rate_hz):
    rho = np.exp(-1 / (rate_hz * 0.02))
    white = np.random.default_rng(0).standard_normal((samples + 200, 2))
    return lfilter([np.sqrt(1 - rho**2)], [1, -rho], white, axis=0)[200:] * NOISE


def blocks(motion):
    """Averages over 25 ms: the filter, the samples that remain, and whether all of a block's
    samples are good."""
    block = block_average(motion)
    starts = block.starts(motion.segment)
    return (
        lambda x: block.mean(x, starts),
        starts + block.decimation // 2,
        lambda good: block.all(good, starts),
    )


def five_hertz(motion):
    """A zero-phase low-pass at 5 Hz, every sample kept."""
    return lambda x: low_pass(x, motion.sample_rate_hz, 5.0), slice(None), lambda good: good


def left(regressor, torque, noise, rows):
    """RMS residual of a weighted fit over the noise's own rms, for each joint."""
    A = np.concatenate([regressor[rows[:, j], j] / NOISE[j] for j in range(2)])
    y = np.concatenate([torque[rows[:, j], j] / NOISE[j] for j in range(2)])
    values = np.linalg.lstsq(A, y, rcond=None)[0]
    both = rows.all(axis=1)
    return np.sqrt(
        np.mean((torque - regressor @ values)[both] ** 2, axis=0)
        / np.mean(noise[both] ** 2, axis=0)
    )


@pytest.mark.parametrize("method", [blocks, five_hertz])
def test_only_one_filter_for_both_sides_away_from_reversals_leaves_the_noise_itself(
    noiseless_motions, method
):
    motion = noiseless_motions[0]
    noise = coloured(len(motion), motion.sample_rate_hz)
    effects = baseline(motion.machine, ("exo_alone",))
    regressor = Model.of(effects).regressor(motion)
    smooth, kept, whole = method(motion)
    valid = whole(np.column_stack([motion.valid, motion.valid]))
    moving = valid & whole(away_from_reversals(motion))
    torque, rest = smooth(motion.torque + noise), smooth(noise)
    torque_alone = left(regressor[kept], torque, rest, valid)
    both_alike = left(smooth(regressor), torque, rest, valid)
    masked = left(smooth(regressor), torque, rest, moving)
    print(
        f"\n{method.__name__}: torque alone {torque_alone}, both alike {both_alike}, and masked"
        f" {masked}"
    )
    assert np.all(torque_alone > both_alike)
    assert np.all(both_alike > 1.08)
    np.testing.assert_allclose(masked, 1.0, atol=0.02)
