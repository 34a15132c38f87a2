"""The gallery's figures have the features that the effects' pages describe."""

from pathlib import Path

import numpy as np
import pytest

from pipelines.model import effect_named

NOISE_NM = 0.1
"""Of the quiet leg that the figures are drawn from."""


@pytest.fixture
def signature_of(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs" / "site")
    from signatures import signature

    def of(name):
        """Return the usable residual, angle and velocity of the joint that the figure shows."""
        drawn = signature(effect_named(name))
        joint, regression = drawn.joint, drawn.regression
        usable = regression.usable[:, joint]
        q, dq, _ = regression.state
        return drawn.residual[usable, joint], q[usable, joint], dq[usable, joint]

    return of


def test_a_ripple_is_the_same_wave_over_the_angle_both_ways(signature_of):
    residual, angle, velocity = signature_of("cogging")
    bins = np.linspace(angle.min(), angle.max(), 21)
    there, back = (mean_in(bins, angle[way], residual[way]) for way in (velocity > 0, velocity < 0))
    known = np.isfinite(there) & np.isfinite(back)
    assert np.corrcoef(there[known], back[known])[0, 1] > 0.95


def test_a_coupling_that_other_parameters_take_up_leaves_noise(signature_of):
    residual, *_ = signature_of("rotor_coupling")
    assert np.std(residual) < 1.2 * NOISE_NM


def test_spasticity_is_a_ramp_beyond_a_speed_one_way_only(signature_of):
    residual, _, velocity = signature_of("spasticity")
    fast = np.quantile(velocity[velocity > 0], 0.9)
    assert residual[velocity > fast].mean() > 3 * NOISE_NM
    assert abs(residual[velocity < -fast].mean()) < NOISE_NM


def mean_in(bins, x, y):
    place = np.digitize(x, bins)
    return np.array(
        [y[place == k].mean() if np.sum(place == k) > 4 else np.nan for k in range(1, len(bins))]
    )
