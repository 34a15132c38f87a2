"""The campaign hides causes as large as predictions take them."""

import numpy as np
import pytest

from pipelines.design.excitation import design
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.investigation.rivals import rivals_named
from pipelines.mechanics.machine import THE_LEG
from pipelines.settings.design import DesignSettings
from tests.campaigns import separation


@pytest.mark.parametrize("number", [0, 1])
def test_a_hidden_cause_has_the_predicted_share_of_its_joint_s_torque(number, monkeypatch):
    monkeypatch.setattr(separation, "SECONDS", 10.0)
    usual = design(DesignSettings(harmonics=3, particles=16, iterations=25)).trajectory
    rivals = tuple(rivals_named(["rotor_inertia@knee", "quadratic_drag@knee"], THE_LEG))
    term = separation.truth_of(rivals, number, usual)
    motions = separation.session(term, usual, seed=1)
    squares = [
        np.mean(torque[:, 1] ** 2)
        for motion in motions
        for torque in (term.effect.torque(motion, term.values), motion.torque)
    ]
    share = np.sqrt(np.sum(squares[::2]) / np.sum(squares[1::2]))
    # Predictions count samples away from reversals only.
    assert share == pytest.approx(np.mean(CRITERIA.amplitudes), rel=0.25)
