"""The criteria of look-alikes are recovered from causes that were drawn by them."""

import numpy as np
import pytest
from scipy.special import expit

from tests.campaigns.learn.look_alikes import JudgedCause, learn_look_alike


def drawn(count, certain, slope, seed=3):
    rng = np.random.default_rng(seed)
    removed = rng.uniform(0.02, 1.0, count)
    probability = rng.uniform(0.5, 1.0, count)
    is_right = rng.random(count) < probability * expit(certain + slope * np.log(removed))
    columns = probability.tolist(), removed.tolist(), [0.0] * count, is_right.tolist()
    return [JudgedCause(*one) for one in zip(*columns, strict=True)]


def test_the_criteria_that_causes_were_drawn_by_are_recovered_and_calibrated():
    learned = learn_look_alike(drawn(4000, 3.0, 2.0))
    assert learned["look_alike"] == pytest.approx([3.0, 2.0], rel=0.2)
    assert learned["learned"]["calibration_error"] < 0.03 < learned["without"]["calibration_error"]
    assert learned["learned"]["mean_log"] >= learned["now"]["mean_log"] - 1e-6


def test_causes_that_are_all_right_give_finite_criteria():
    learned = learn_look_alike([JudgedCause(0.99, 0.9, 0.0, True)] * 20)
    assert np.isfinite(learned["look_alike"]).all()
