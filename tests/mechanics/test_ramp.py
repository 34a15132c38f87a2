import numpy as np
from numpy.testing import assert_allclose

from pipelines.mechanics.ramp import smooth_share


def test_a_ramp_leaves_rest_and_arrives_without_a_jump_in_speed_or_acceleration():
    t = np.linspace(-0.5, 1.5, 20001)
    share = smooth_share(t)
    speed = np.gradient(share, t)
    assert_allclose(share[[0, 10000, -1]], [0.0, 0.5, 1.0], atol=1e-12)
    assert np.all(np.diff(share) >= 0.0)
    # The steepest change of the quintic's acceleration is 60 per ramp length cubed.
    assert np.abs(np.diff(np.gradient(speed, t))).max() < 1.1 * 60.0 * (t[1] - t[0])
