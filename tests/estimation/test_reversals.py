"""What is left out beside reversals: as far as the low-pass smears a step of friction."""

import numpy as np
import pytest

from pipelines.estimation.regression import away_from_reversals, padding
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from pipelines.signals.low_pass import low_pass
from tests.diagnosis.sessions import recordings


@pytest.fixture(scope="module")
def recording():
    return recordings(seconds=20.0)[0]


@pytest.mark.parametrize("cutoff_hz", [3.0, 4.2, 6.0, 12.0])
def test_away_from_reversals_a_smeared_step_of_friction_is_over(recording, cutoff_hz):
    motion = motion_from_table(motion_table(recording, FilterSettings(cutoff_hz=cutoff_hz)))
    friction = np.sign(motion.dq)
    smeared = low_pass(friction, motion.sample_rate_hz, cutoff_hz)
    away = away_from_reversals(motion) & motion.valid[:, np.newaxis]
    assert np.abs(smeared - friction)[away].max() < 0.06
    assert away.mean() > 0.3


def test_at_the_default_cutoff_the_reach_is_what_a_freed_joint_needs(recording):
    motion = motion_from_table(motion_table(recording, FilterSettings()))
    assert padding(motion) / motion.sample_rate_hz == 0.08
