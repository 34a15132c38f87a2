"""The gallery's figures show what the effects' pages say that they look like."""

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
        """Return what is left, the angle and the speed of the joint that the figure shows, where
        they are usable."""
        made = signature(effect_named(name))
        usable = made.regression.usable[:, made.joint]
        q, dq, _ = made.regression.state
        return made.left[usable, made.joint], q[usable, made.joint], dq[usable, made.joint]

    return of


def test_a_ripple_is_the_same_wave_over_the_angle_both_ways(signature_of):
    left, angle, speed = signature_of("cogging")
    bins = np.linspace(angle.min(), angle.max(), 21)
    there, back = (mean_in(bins, angle[way], left[way]) for way in (speed > 0, speed < 0))
    known = np.isfinite(there) & np.isfinite(back)
    assert np.corrcoef(there[known], back[known])[0, 1] > 0.95


def test_a_coupling_that_other_parameters_take_up_leaves_noise(signature_of):
    left, *_ = signature_of("rotor_coupling")
    assert np.std(left) < 1.2 * NOISE_NM


def test_spasticity_is_a_ramp_beyond_a_speed_one_way_only(signature_of):
    left, _, speed = signature_of("spasticity")
    fast = np.quantile(speed[speed > 0], 0.9)
    assert left[speed > fast].mean() > 3 * NOISE_NM
    assert abs(left[speed < -fast].mean()) < NOISE_NM


def mean_in(bins, x, y):
    place = np.digitize(x, bins)
    return np.array(
        [y[place == k].mean() if np.sum(place == k) > 4 else np.nan for k in range(1, len(bins))]
    )
