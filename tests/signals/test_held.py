"""Values that repeat because new ones come less often than rows, and those that rest."""

import numpy as np
import pytest

from pipelines.signals.held import are_held

RATE_HZ = 100.0
TIME_S = np.arange(200) / RATE_HZ


def torque_at(time_s):
    return np.round(30000.0 * np.sin(10.0 * time_s))


@pytest.mark.parametrize("new_hz", [5.0, 20.0, 50.0, 80.0, 90.0])
def test_values_that_are_renewed_slower_than_rows_are_held(new_hz):
    renewed_s = np.floor(TIME_S * new_hz + 1e-9) / new_hz
    assert are_held(torque_at(renewed_s)) == (len(np.unique(renewed_s)) >= 10)


@pytest.mark.parametrize("start_s", np.arange(0.0, 0.6, 0.02))
def test_a_torque_that_is_cut_off_is_not_held_whatever_part_is_seen(start_s):
    torque = torque_at(TIME_S[:100] + start_s)
    assert not are_held(np.clip(torque, -20000.0, 20000.0))


@pytest.mark.parametrize("rows", [5, 9, 40])
def test_a_joint_that_rests_once_is_not_held(rows):
    moving = torque_at(TIME_S)
    assert not are_held(np.r_[np.full(rows, moving[0]), moving])


def test_coarse_values_are_not_held():
    assert not are_held(np.round(torque_at(TIME_S) / 3000.0))
