"""The torque channel does to a torque what it says, and nothing else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.campaigns.blind.channel import Channel, through

PERIOD_S = 0.001
T = np.arange(4000) * PERIOD_S
TORQUE = np.column_stack([10.0 * np.sin(5.0 * T), 4.0 * np.cos(3.0 * T)])
ANGLE = np.column_stack([0.6 + 0.4 * np.sin(2.0 * T), -0.9 + 0.3 * np.cos(2.0 * T)])
HIP, KNEE = 0, 1


def metadata_of(**values):
    channel = Channel()
    for name, value in values.items():
        member = getattr(channel, name)
        if isinstance(member, tuple):
            member[HIP].append(value)
        else:
            member[HIP] = value
    return through(channel, TORQUE, PERIOD_S, ANGLE)


def test_a_sound_channel_changes_nothing():
    assert_allclose(through(Channel(), TORQUE, PERIOD_S, None), TORQUE, atol=1e-12)


@pytest.mark.parametrize(
    ("values", "hip"),
    [
        ({"gain": 1.1}, 1.1 * TORQUE[:, HIP]),
        ({"offset": 0.5}, TORQUE[:, HIP] + 0.5),
        ({"bend": 0.01}, TORQUE[:, HIP] * (1.0 + 0.01 * np.abs(TORQUE[:, HIP]))),
        ({"lopsided": 0.1}, TORQUE[:, HIP] + 0.1 * np.abs(TORQUE[:, HIP])),
        ({"cross": np.array([0.0, 0.2])}, TORQUE[:, HIP] + 0.2 * TORQUE[:, KNEE]),
        ({"moving_gain": lambda t: 0.1 * t}, TORQUE[:, HIP] * (1.0 + 0.1 * T)),
        ({"ripple": lambda q: np.sin(300.0 * q)}, TORQUE[:, HIP] + np.sin(300.0 * ANGLE[:, HIP])),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_an_error_is_what_it_is_called_and_leaves_the_other_joint_alone(values, hip):
    out = metadata_of(**values)
    assert_allclose(out[:, HIP], hip, atol=1e-9)
    assert_allclose(out[:, KNEE], TORQUE[:, KNEE], atol=1e-12)


def test_a_delay_and_two_lags_make_a_slow_torque_late_by_their_sum():
    out = metadata_of(delay_s=0.01, lag_s=0.02, second_lag_s=0.005)[500:, HIP]
    late = [
        np.mean((np.interp(T[500:] - s, T, TORQUE[:, HIP]) - out) ** 2)
        for s in (0.025, 0.035, 0.045)
    ]
    assert np.argmin(late) == 1


def test_a_held_torque_stays_and_a_coarse_one_has_steps():
    held = metadata_of(hold_s=0.02)[:, HIP].reshape(-1, 20)
    assert np.all(held == held[:, :1])
    steps = metadata_of(quantum=0.5)[:, HIP] / 0.5
    assert_allclose(steps, np.round(steps), atol=1e-9)
    blank = metadata_of(dead_band=1.0)[:, HIP]
    assert np.all(blank[np.abs(TORQUE[:, HIP]) < 0.99] == 0.0)


def test_a_leak_that_lags_follows_the_other_joint_later():
    out = metadata_of(cross=np.array([0.0, 0.3]), cross_lag_s=0.05)[:, HIP] - TORQUE[:, HIP]
    slow = 0.3 * np.interp(T - 0.05, T, TORQUE[:, KNEE])
    assert np.std(out[500:] - slow[500:]) < 0.1 * np.std(slow)
