"""A double pendulum whose makers published its parameters: joint torques are foretold better than by these."""

import pytest

from tests.real.machines import LOGS, diagnosed, of_purpose
from tests.real.published import double_pendulum, their_torque
from tests.real.relative_error import slow_error

LEAST_SQUARES = (6.0, 13.2)
"""Percent that ordinary least squares leaves of the Fourier run's last 30 % (the README of the data)."""


@pytest.fixture(scope="module")
def fourier(real_data, tmp_path_factory):
    return diagnosed(LOGS["A0-fourier"], real_data, tmp_path_factory.mktemp("A0"))


@pytest.fixture(scope="module")
def theirs(real_data):
    return double_pendulum(real_data / "double_pendulum" / "A0_published_parameters.yml")


def test_the_extended_model_foretells_the_rest_of_the_fourier_run(fourier):
    (rest,) = of_purpose(fourier.motions, "validate")
    error = slow_error(fourier.model.torque(rest), rest)
    assert error.percent[0] < LEAST_SQUARES[0]
    assert error.percent[1] < LEAST_SQUARES[1]


def test_the_extended_model_is_better_than_the_published_parameters(fourier, theirs):
    for motion in fourier.motions:
        ours = slow_error(fourier.model.torque(motion), motion)
        published = slow_error(their_torque(theirs, motion), motion)
        assert (ours.rms < published.rms).all(), motion.file
