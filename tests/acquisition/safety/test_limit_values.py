"""Each limit holds at its value, and breaks just beyond it, on either side."""

import re
from math import isnan, nan
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from pipelines.acquisition.machine.row import Answers
from pipelines.acquisition.safety.limits import (
    HOLD_SAMPLES,
    Limits,
    allowed_error_rad,
    clamped,
    refuse_leap,
    slowed,
)
from pipelines.acquisition.safety.safe_stop import SafeStop
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig import load_rig
from tests.acquisition.safety.test_limits import RATE, reading, row

BEYOND = 1.0 + 1e-6
CUFFS_AT_REST = np.zeros((4, 3))


@pytest.fixture
def rig(rig_file):
    return load_rig(rig_file())


@pytest.fixture
def recorder(rig_file):
    """A rig whose drives take four samples from one set-point to the next."""
    rig = load_rig(rig_file("recorder"))
    assert rig.record_rate_hz == 4 * 250.0 and rig.samples_per_cycle(250.0) == 4
    return rig


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("quantity", ["angle", "velocity", "torque"])
def test_a_sample_at_its_limit_is_kept_and_one_beyond_is_not(rig, joint, side, quantity):
    drive = rig.drive[joint]
    low, high = drive.angle_rad
    limit = {
        "angle": high if side > 0 else -low,
        "velocity": drive.speed_rad_s,
        "torque": drive.torque_nm,
    }[quantity]
    name, limits = ("hip", "knee")[joint], Limits(rig, RATE)
    assert limits.violation(row(**{name: {quantity: side * limit}})) is None
    broken = limits.violation(row(**{name: {quantity: side * limit * BEYOND}}))
    assert broken is not None and broken.startswith(name)


@pytest.mark.parametrize("cuff", range(4))
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_force_at_its_limit_is_kept_and_one_beyond_is_not(rig, cuff, axis, side):
    limits, forces = Limits(rig, RATE), CUFFS_AT_REST.copy()
    forces[cuff, axis] = side * rig.safety.cuff_force_n
    assert limits.violation(row(forces=forces)) is None
    forces[cuff, axis] *= BEYOND
    assert f"force {'xyz'[axis]}" in limits.violation(row(forces=forces))


@pytest.mark.parametrize("later", [1, 3, 4])
def test_a_speed_by_angles_is_the_travel_over_the_drives_own_samples(recorder, later):
    limit = recorder.drive[0].speed_rad_s
    for travel, kept in ((limit * later / 1000.0, True), (limit * later / 1000.0 * BEYOND, False)):
        limits = Limits(recorder, 250.0)
        for sequence, angle in ((7, 0.0), (7 + later, travel)):
            moved = {"sequence": sequence, "angle": angle, "velocity": nan}
            why = limits.violation(row(hip=moved))
        assert (why is None) == kept


def test_the_last_sample_is_that_of_the_same_drive(rig):
    limits = Limits(rig, RATE)
    silent = {"velocity": nan}
    assert limits.violation(row(hip=silent, knee={"angle": -1.0, **silent})) is None
    stays = {"sequence": 1, **silent}
    assert limits.violation(row(hip=stays, knee={"angle": -1.0, **stays})) is None
    # A counter that stands still is another check's; the angle may not leap for it.
    assert "hip speed" in limits.violation(row(hip={"angle": 0.1, **stays}, knee=stays))


@pytest.mark.parametrize("late", [0, 1, 2, 5])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_joint_may_stray_by_the_following_error_and_what_it_goes_on_by(rig, late, side, joint):
    allowed = rig.safety.following_error_rad + rig.drive[joint].speed_rad_s * late / RATE
    limits, name = Limits(rig, RATE), ("hip", "knee")[joint]
    for error, kept in ((allowed * (1.0 - 1e-9), True), (allowed * BEYOND, False)):
        samples = row(**{name: {"angle": 0.2 + side * error}})
        set_points = [0.2 if j == joint else 0.0 for j in range(2)]
        assert (limits.straying(samples, set_points, late) is None) == kept
    at_the_limit = row(**{name: {"angle": side * rig.safety.following_error_rad}})
    assert limits.straying(at_the_limit, [0.0, 0.0]) is None
    assert limits.straying(row(**{name: {"angle": nan}}), [0.0, 0.0]) is not None


@pytest.mark.parametrize("late", [0, 3])
def test_a_safe_stop_presses_from_the_error_on_at_which_a_run_is_stopped(rig, late):
    allowed = allowed_error_rad(rig.safety, rig.drive[0], late / RATE)
    tracker = SimpleNamespace(drive=rig.drive[0], base=0.0)
    for error, presses in ((allowed, False), (allowed * BEYOND, True)):
        stop = SafeStop(rig.safety, RATE, [tracker], Mock(), Mock())
        stop.check(0, reading(angle=error), late)
        stray = Limits(rig, RATE).straying(row(hip={"angle": error}), [0.0, 0.0], late)
        assert (stop.pressing, stray is not None) == (presses, presses)


def test_a_drive_that_did_not_answer_strays_from_nothing_and_the_other_is_judged(rig):
    limits = Limits(rig, RATE)
    far = reading(angle=1.0)
    answers = Answers((Unanswered("late"), far), CUFFS_AT_REST, None)
    assert limits.straying(answers, [0.0, 1.0]) is None
    assert limits.straying(answers, [0.0, 0.0]).startswith("knee")
    assert limits.violation(Answers((Unanswered("late"), reading()), CUFFS_AT_REST, None)) is None


@pytest.mark.parametrize("kind", ["plain", "recorder"])
@pytest.mark.parametrize("every", [1, 3])
def test_a_cuff_may_be_silent_for_the_watchdogs_time_and_one_of_its_turns(rig_file, kind, every):
    rig = load_rig(rig_file(kind, watchdog_s=0.2))
    rate = 50.0 if kind == "plain" else 250.0
    samples = rig.samples_per_cycle(rate)
    sensors = [sensor.model_copy(update={"every": every}) for sensor in rig.sensor]
    most = round(0.2 * rate) + every  # cycles
    silent = np.full((4, 3), nan)
    begin = 40

    def after(cycles, forces):
        limits = Limits(rig, rate, sensors)
        assert limits.violation(row(hip={"sequence": samples * begin}, forces=forces)) is None
        # The last sample of its cycle.
        sequence = samples * (begin + cycles + 1) - 1
        return limits.violation(row(hip={"sequence": sequence}, forces=silent))

    for first in (CUFFS_AT_REST, silent):  # silence begins at the latest with the first cycle
        assert after(most, first) is None
        why = after(most + 1, first)
        assert "watchdog: no new sample from sensor thigh_front" in why
        assert f"for {(most + 1) / rate:.3f} s, allowed are 0.2 s" in why
    assert Limits(rig, rate).violation(row(hip={"sequence": 9999}, forces=silent)) is None


def test_a_cuff_that_answers_again_is_not_silent(rig):
    limits = Limits(rig, 50.0, rig.sensor)
    cycles = round(rig.safety.watchdog_s * 50.0)
    silent = np.full((4, 3), nan)
    for cycle, forces in ((0, CUFFS_AT_REST), (cycles, CUFFS_AT_REST), (2 * cycles, silent)):
        assert limits.violation(row(hip={"sequence": cycle}, forces=forces)) is None
    # One component that is no number makes the whole sensor silent.
    partly = CUFFS_AT_REST.copy()
    partly[0] = nan
    assert "thigh_front" in limits.violation(row(hip={"sequence": 4 * cycles}, forces=partly))


@pytest.mark.parametrize("end", [0, 1])
def test_a_set_point_at_its_limit_is_sent_and_one_beyond_is_not(rig, end):
    drive = rig.drive[0]
    limit = drive.angle_rad[end]
    refuse_leap(drive, limit, limit, 1 / RATE)
    with pytest.raises(DeviceError, match=r"outside its limits .* it was not sent"):
        refuse_leap(drive, limit, limit * BEYOND, 1 / RATE)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("time_s", [0.005, 0.02])
def test_a_set_point_goes_as_far_as_the_speed_limit_leads_and_no_further(rig, side, time_s):
    drive = rig.drive[0]
    far = drive.speed_rad_s * time_s
    # But for rounding.
    refuse_leap(drive, 0.5, 0.5 + side * (far + 0.9e-9), time_s)
    with pytest.raises(DeviceError, match=r"faster than its limit .* it was not sent"):
        refuse_leap(drive, 0.5, 0.5 + side * (far + 2e-9), time_s)


def test_a_value_is_clamped_to_the_nearest_bound_and_no_number_stays_none():
    assert [clamped(x, -1.0, 2.0) for x in (-3.0, -1.0, 0.5, 2.0, 7.0)] == [-1, -1, 0.5, 2, 2]
    assert isnan(clamped(nan, -1.0, 2.0))


@pytest.mark.parametrize("speed", [1.5, -1.5, 0.0])
@pytest.mark.parametrize("share", [0.25, 0.5, 1.0, 1.5])
def test_slowing_down_is_that_of_constant_deceleration(speed, share):
    deceleration = 6.0
    stop_s = abs(speed) / deceleration
    t = share * stop_s
    reference, remaining = slowed(0.3, speed, deceleration, t)
    moving = min(t, stop_s)
    way = np.sign(speed) * (abs(speed) * moving - deceleration * moving**2 / 2)
    assert reference == pytest.approx(0.3 + way, abs=1e-12)
    assert remaining == pytest.approx(speed * max(0.0, 1.0 - share), abs=1e-12)


def test_a_stopped_drive_holds_as_long_as_the_page_on_safety_says():
    page = (Path(__file__).parents[3] / "docs" / "safety.md").read_text(encoding="utf-8")
    assert re.findall(r"(?:hold|held there) for (\d+) samples", page) == 2 * [str(HOLD_SAMPLES)]
