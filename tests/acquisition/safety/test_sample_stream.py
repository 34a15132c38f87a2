"""What one drive tells is held against what it told before, whether an exchange brought it or its
own record."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.safety.sample_stream import SampleStream
from pipelines.acquisition.safety.set_point_history import SetPointHistory
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

CYCLE_HZ, RATE_HZ = 200.0, 1000.0
BEGINS = 5000


def moved(number):
    """What a hip that swings with a period of 2 s tells of a sample."""
    at = (number - BEGINS) / RATE_HZ
    angle, velocity = 0.3 * np.sin(np.pi * at), 0.3 * np.pi * np.cos(np.pi * at)
    current = np.sin(37.0 * at)
    return Reading(number, 7.0 + at, angle, 12.0 * current, current, velocity, 20.0, angle)


@pytest.fixture
def hip():
    """The stream of a hip's records, 1000 a second with 200 set-points, which it was sent until
    now."""
    history = SetPointHistory()
    for number in range(BEGINS, BEGINS + 2000, 5):
        history.add(number, moved(number).angle)
    return stream_of(history)


def stream_of(history):
    return SampleStream(load_rig(datasets() / "rigs" / "recorder.toml"), 0, CYCLE_HZ, history)


def take(stream, *samples):
    return [stream.check(sample, 1.0) for sample in samples]


def swing(stream, until):
    return take(stream, *(moved(number) for number in range(BEGINS, until)))


def test_a_motion_within_limits_contradicts_nothing_and_each_sample_is_new_once(hip):
    assert all(swing(hip, BEGINS + 1500))
    assert take(hip, moved(BEGINS + 1499)) == [False]
    assert take(hip, moved(BEGINS + 1600)) == [True]  # those between were overwritten


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ({"angle": 0.7}, r"hip .*: its angle leapt from 0\.\d+ to 0\.7000 rad within 0\.0010 s"),
        ({"angle": moved(BEGINS + 400).angle + 0.004}, "faster than its limit of 3 rad/s"),
        ({"time": 3.0}, "its clock went from"),
        (
            {"time": 7.41},
            "its clock went on by 0.011000 s while its counter went on by 1 samples of 0.001000 s",
        ),
        (
            {"sequence": BEGINS + 402},
            "its clock went on by 0.001000 s while its counter went on by 3 samples",
        ),
        ({"sequence": BEGINS + 300}, "its sample counter went back"),
        ({"sequence": BEGINS + 400 + 2**16}, "its sample counter leapt"),
        ({"torque": 151.0}, "hip torque 151.0 N·m is above its limit"),
        ({"torque": np.nan}, "hip torque nan N·m is above its limit"),
        ({"velocity": 2.9}, "but it reports a speed of"),
        ({"reference": 1.2}, "follows a set-point of 1.2000 rad, but was sent"),
    ],
)
def test_one_damaged_sample_ends_the_run_before_it_is_kept(hip, damage, words):
    swing(hip, BEGINS + 400)
    if "velocity" in damage:  # mean of two samples
        hip._last = replace(hip._last, velocity=2.9)
    with pytest.raises(DeviceError, match=words):
        take(hip, replace(moved(BEGINS + 400), **damage))


REGISTERS = "check the encoder, or the "


@pytest.mark.parametrize(
    ("after", "when", "damage"),
    [
        (0, "before it", {"angle": 0.9}),
        (35, "0.035 s before it", {"angle": 0.7}),
        (35, "0.035 s before it", {"velocity": -2.0}),
    ],
)
def test_after_missed_samples_a_jerk_of_the_leg_is_named_before_the_registers(
    hip, after, when, damage
):
    swing(hip, BEGINS + 400)
    again = BEGINS + 420
    take(hip, *(moved(number) for number in range(again, again + after)))
    with pytest.raises(DeviceError) as raised:
        take(hip, replace(moved(again + after), **damage))
    told = (
        f"rad/s; samples or set-points were missed {when}, which may jerk a leg: see why answers"
        " are lost or late, or "
    )
    assert f"{told}make the motion slower; else {REGISTERS}" in str(raised.value)


def test_a_limit_broken_after_set_points_were_left_out_is_reported_with_them(
    hip,
):
    swing(hip, BEGINS + 400)
    hip.leave_out(BEGINS + 380, BEGINS + 400)
    take(hip, *(moved(number) for number in range(BEGINS + 400, BEGINS + 435)))
    with pytest.raises(
        DeviceError,
        match=r"torque 900.0 N·m is above .*; samples or set-points were missed 0.035 s bef",
    ):
        take(hip, replace(moved(BEGINS + 435), torque=900.0))


def test_samples_that_were_missed_long_before_are_no_reason(hip):
    swing(hip, BEGINS + 100)
    take(hip, *(moved(number) for number in range(BEGINS + 200, BEGINS + 1300)))
    with pytest.raises(DeviceError) as raised:
        take(hip, replace(moved(BEGINS + 1300), angle=0.7))
    assert f"rad/s; {REGISTERS}" in str(raised.value)


@pytest.mark.parametrize("name", ["angle", "velocity", "current"])
def test_a_register_of_a_record_that_stands_still_while_the_joint_is_told_to_move_is_frozen(
    hip, name
):
    # Slower than a quarter of the limit, or angle and speed would contradict each other before.
    swing(hip, BEGINS + 1250)
    held = {name: getattr(moved(BEGINS + 1250), name)}
    with pytest.raises(
        DeviceError, match=f"reports {name} .*; its register is frozen, or the joint is blocked"
    ):
        for number in range(BEGINS + 1250, BEGINS + 1450):
            take(hip, replace(moved(number), **held))


def test_a_joint_that_sticks_to_its_friction_is_left_to_the_following_error(hip):
    """Its angle stands still and so does its speed, at nought: neither contradicts the other, and
    its current rises."""
    swing(hip, BEGINS + 1250)
    stuck = replace(moved(BEGINS + 1250), velocity=0.0)
    sticking = [
        replace(moved(k), angle=stuck.angle, velocity=0.0)
        for k in range(BEGINS + 1250, BEGINS + 1450)
    ]
    assert abs(moved(BEGINS + 1450).angle - stuck.angle) > 0.06
    assert all(take(hip, *sticking))


def test_a_register_that_stands_still_while_the_joint_is_told_to_stand_is_not():
    still = SetPointHistory()
    still.add(BEGINS, 0.0)
    at_rest = [
        replace(moved(BEGINS), sequence=BEGINS + k, time=7.0 + k / RATE_HZ, velocity=0.0)
        for k in range(500)
    ]
    assert all(take(stream_of(still), *at_rest))


def test_a_late_record_is_held_against_what_the_joint_was_told_then_and_not_since():
    """The joint has moved on by then: that way is none that the record did not follow."""
    history = SetPointHistory()
    for number in range(BEGINS, BEGINS + 1000, 5):
        history.add(number, 0.0 if number < BEGINS + 500 else 0.3)
    at_rest = [
        replace(moved(BEGINS), sequence=BEGINS + k, time=7.0 + k / RATE_HZ, velocity=0.0)
        for k in range(490)
    ]
    assert all(take(stream_of(history), *at_rest))


def test_a_drive_without_a_velocity_is_checked_against_its_newest_sample(hip):
    """Against an older one its speed would be a mean since then."""
    swing(hip, BEGINS + 1000)
    newest = moved(BEGINS + 999)
    leapt = replace(moved(BEGINS + 1000), angle=newest.angle + 0.05, velocity=np.nan)
    assert "hip speed" in hip.limit_violation(leapt)
    assert hip.limit_violation(replace(leapt, angle=newest.angle)) is None


def test_a_record_may_wait_for_the_samples_of_one_read_and_the_watchdogs_time(hip):
    ring = hip._waiting
    swing(hip, BEGINS + 100)
    hip.refuse_to_fall_behind(BEGINS + 99 + hip._most + ring)
    with pytest.raises(DeviceError, match="its record brought none after"):
        hip.refuse_to_fall_behind(BEGINS + 100 + hip._most + ring)
    assert ring < 125


def test_a_record_that_stands_still_while_the_counter_goes_on_ends_the_run(hip):
    swing(hip, BEGINS + 100)
    hip.refuse_to_fall_behind(BEGINS + 300)
    with pytest.raises(
        DeviceError, match=r"is at sample 5\d\d\d, but its record brought none after 5099"
    ):
        hip.refuse_to_fall_behind(BEGINS + 600)


def test_a_record_that_never_brought_anything_ends_the_run_too(hip):
    hip.refuse_to_fall_behind(BEGINS)
    with pytest.raises(DeviceError, match="its record brought none after 5000"):
        hip.refuse_to_fall_behind(BEGINS + 600)


def test_silence_is_borne_for_the_watchdogs_time_and_its_last_reason_told(hip):
    hip.begin(moved(BEGINS), 10.0)
    hip.refuse_silence(10.24)
    with pytest.raises(
        DeviceError,
        match=r"watchdog: no new sample from drive hip .* for 0\.260 s, allowed are 0\.25 s",
    ):
        hip.refuse_silence(10.26)
    hip.miss(Unanswered("drive hip: did not answer"))
    with pytest.raises(Unanswered, match="did not answer"):
        hip.refuse_silence(10.26)


def test_a_cycle_that_brings_a_sample_more_than_usual_is_no_jerk(hip):
    """Where drives record themselves, the host's cycle takes one of their samples more now and
    then."""
    swing(hip, BEGINS + 100)
    take(hip, moved(BEGINS + 105))
    assert hip.after_jerk("too much") == "too much"
    take(hip, moved(BEGINS + 115))
    assert "too much; samples or set-points were missed before it" in hip.after_jerk("too much")


def test_a_record_from_before_set_points_were_left_out_is_not_blamed_on_them(hip):
    swing(hip, BEGINS + 100)
    hip.leave_out(BEGINS + 110, BEGINS + 120)
    assert hip.after_jerk("too much") == "too much"
    take(hip, moved(BEGINS + 100))
    assert hip.after_jerk("too much", moved(BEGINS + 112)) != "too much"
