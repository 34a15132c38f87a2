"""A rigid body predicts what it was not fitted to, however little of its law a run shows."""

import numpy as np
import pytest

from pipelines.diagnosis.data_faults.rigid_fit import Columns, predicted


@pytest.mark.parametrize("travel", [0.3, 0.2, 0.1, 0.05, 0.01, 0.003])
def test_over_small_angles_gravity_and_a_law_of_the_angle_do_not_cancel(travel):
    """Nearly one column each, they would be fitted by huge values of opposite sign."""
    wave = np.sin(np.linspace(0.0, 40.0, 600)) * np.linspace(0.5, 1.0, 600)
    angle = 0.9 + travel * wave
    law = np.vander(angle, 4, increasing=True)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        acceleration, noise = rng.normal(0.0, (1.0, 0.1), (600, 2)).T
        body = np.column_stack([acceleration, np.sin(angle), np.cos(angle)])
        torque = body @ (2.0, 10.0, 0.0) + noise
        error = torque - predicted(Columns(body, law), torque)
        assert np.sqrt(np.mean(error**2)) < 0.12
