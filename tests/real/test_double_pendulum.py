"""A double pendulum whose makers published its parameters: joint torques are foretold better than by these."""

import pytest

from tests.real.machines import LOGS, diagnosed
from tests.real.published import double_pendulum, their_torque
from tests.real.relative_error import slow_error


@pytest.fixture(scope="module")
def fourier(real_data, tmp_path_factory):
    return diagnosed(LOGS["A0-fourier"], real_data, tmp_path_factory.mktemp("A0"))


@pytest.fixture(scope="module")
def theirs(real_data):
    return double_pendulum(real_data / "double_pendulum" / "A0_published_parameters.yml")


def test_the_extended_model_is_better_than_the_published_parameters(fourier, theirs):
    for motion in fourier.motions:
        ours = slow_error(fourier.model.torque(motion), motion)
        published = slow_error(their_torque(theirs, motion), motion)
        assert (ours.rms < published.rms).all(), motion.file
