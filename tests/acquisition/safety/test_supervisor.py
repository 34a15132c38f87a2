"""The safety state machine itself: as it is drawn, and what may not be skipped."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipelines.acquisition.machine.reading import DriveStatus, Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.states import FOLLOWING, TRANSITIONS, Conditions, State, check_guard
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.simulated import Event, simulate
from tests.acquisition.test_invariants import FINE_RAD, REST_RAD, RIGS, TRAJECTORY

DRAWING = Path(__file__).parents[3] / "docs" / "safety.md"
RATE = 200.0


def test_the_drawing_has_the_transitions_of_the_code_and_no_others():
    chain, branches, bottom = re.search(
        r"```text\n(.+)\n(.+)\n(.+)\n```", DRAWING.read_text()
    ).groups()
    names = [(match[0].strip(), match.span()) for match in re.finditer(r"[a-z]+( [a-z]+)*", chain)]

    def above(place):
        return next(name for name, (begin, end) in names if begin <= place < end)

    drawn = {(one, other) for (one, _), (other, _) in itertools.pairwise(names)}
    drawn |= {(above(match.start()), "abort") for match in re.finditer("│", branches)}
    drawn |= {("abort", above(match.start())) for match in re.finditer("▲", branches)}
    assert re.fullmatch(r" *└─+(┴─+)+► abort ──┘", bottom)
    assert drawn == {(str(a), str(b)) for a, following in TRANSITIONS.items() for b in following}


def test_the_page_on_safety_names_the_setting_that_bounds_each_control_word_that_is_read_back():
    rows = re.findall(
        r"^\| `(\w+)` \|.*within `safety\.(\w+)`", DRAWING.read_text(), flags=re.MULTILINE
    )
    assert dict(rows) == dict.fromkeys(("enable", "disable", "fault_reset"), "control_s")


def test_every_state_leads_to_rest():
    for state in State:
        if state not in (State.IDLE, State.DISABLED):
            assert State.ABORT in TRANSITIONS[state] or State.DISABLED in TRANSITIONS[state]


@pytest.fixture
def supervisor():
    supervisor = Supervisor(load_rig(datasets() / "rigs" / "real_time.toml"), RATE)
    supervisor.start_checks()
    supervisor.load_plan(
        Plan(np.linspace(0.0, 0.5, 200)[:, np.newaxis] * [1.0, -1.0], 50, 150), np.zeros(2)
    )
    return supervisor


def row(sequence, angle=0.0):
    at_rest = Reading(
        sequence, sequence / RATE, angle, angle, angle, angle, 20.0, np.nan, enabled=True
    )
    return Row((at_rest, at_rest), np.full((4, 3), np.nan))


def enable(supervisor):
    for joint in range(2):
        supervisor.enabling.set_point(joint, 10.0)


def step(supervisor, found, now):
    """Send what is due at a sample; return it, (J,) rad."""
    supervisor.advance(found, now)
    return [supervisor.set_point(joint, now) for joint in range(2)]


def answers(row):
    return Answers(row.drives, row.forces, row)


LOST = Unanswered("drive knee: did not answer an exchange")


def test_what_one_drive_and_the_cuffs_told_is_judged_though_the_other_drive_did_not_answer(
    supervisor,
):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    step(supervisor, 101, 10.005)
    assert (
        supervisor.check_answers(Answers((row(101).drives[0], LOST), row(101).forces, None), 10.006)
        is None
    )
    step(supervisor, 102, 10.01)
    pressed = np.where([[True], [False], [False], [False]], 401.0, np.nan) * np.ones(3)
    with pytest.raises(DeviceError, match="thigh_front force x 401 N is above the limit"):
        supervisor.check_answers(Answers((LOST, LOST), pressed, None), 10.011)
    loaded = replace(row(102).drives[0], torque=151.0)
    with pytest.raises(DeviceError, match=r"hip torque 151\.0 N·m is above its limit"):
        supervisor.check_answers(Answers((loaded, LOST), row(102).forces, None), 10.011)


def test_the_drive_that_is_silent_for_too_long_is_named_though_the_other_one_answers(supervisor):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    for k in range(1, 20):
        supervisor.check_answers(
            Answers((row(100 + k).drives[0], LOST), row(100).forces, None), 10.0 + k / RATE
        )
    with pytest.raises(Unanswered, match="drive knee: did not answer"):
        too_late = 10.001 + supervisor.rig.safety.watchdog_s
        supervisor.check_answers(
            Answers((row(120).drives[0], LOST), row(100).forces, None), too_late
        )


def test_while_drives_are_enabled_only_silence_longer_than_the_watchdogs_time_ends_it(supervisor):
    """At rest one lost reply is no reason to stop, however long enabling has taken before."""
    enabling, longest_s = supervisor.enabling, supervisor.rig.safety.watchdog_s
    enabling.start_at([0.0, 0.0])
    idle = replace(row(100).drives[0], enabled=False)
    answered = Answers((idle, idle), row(100).forces, None)
    lost = Answers((idle, LOST), row(100).forces, None)
    late_s = supervisor.rig.safety.control_s - 1.2 * longest_s
    assert late_s > 2.0 * longest_s
    other = Answers((LOST, idle), row(100).forces, None)
    for k in range(5):
        # One after the other loses a reply, and each has answered just before.
        assert enabling.check((lost, other)[k % 2], k * 0.6 * longest_s) is None
    for waited_s in (3.0 * longest_s, late_s):
        assert enabling.check(answered, waited_s) is None
        assert enabling.check(lost, waited_s) is None
    assert enabling.check(lost, late_s + 0.9 * longest_s) is None
    with pytest.raises(Unanswered, match="drive knee: did not answer"):
        enabling.check(lost, late_s + 1.1 * longest_s)


def test_a_state_cannot_be_skipped(supervisor):
    with pytest.raises(AssertionError, match="there is no way from check to run"):
        supervisor._go(State.RUN)


@pytest.mark.parametrize(
    ("state", "following", "closed"),
    [
        (State.CHECK, State.RAMP, {"all_enabled": False}),
        (State.RAMP, State.RUN, {"due": State.RAMP}),
        (State.RUN, State.RAMP_DOWN, {"due": State.RUN}),
        (State.RAMP_DOWN, State.DISABLED, {"all_disabled": False}),
        (State.ABORT, State.DISABLED, {"all_disabled": False}),
        *((state, State.ABORT, {"reason": None}) for state in (State.CHECK, *FOLLOWING)),
    ],
)
def test_a_state_is_entered_only_under_its_condition(state, following, closed):
    met = Conditions(due=State.RAMP_DOWN, all_enabled=True, all_disabled=True, reason="lost")
    check_guard(state, following, met)
    with pytest.raises(AssertionError, match=f"the way from {state} to {following} is closed"):
        check_guard(state, following, replace(met, **closed))


def test_after_an_abort_no_set_point_of_the_plan_follows_and_the_first_reason_stays(supervisor):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    step(supervisor, 101, 10.005)
    supervisor.abort(DeviceError("the first"))
    supervisor.abort(ValueError("the second"))
    assert (supervisor.state, supervisor.why) == (State.ABORT, "the first")
    assert isinstance(supervisor.fault, ValueError)
    for ask in (
        lambda: supervisor.advance(102, 10.01),
        lambda: supervisor.set_point(0, 10.01),  # whose turn comes only now
        lambda: supervisor.check_answers(answers(row(102)), 10.01),
    ):
        with pytest.raises(DeviceError, match="the first"):
            ask()


def test_many_small_leaps_of_a_counter_do_not_add_up_to_a_speed_above_the_limit(supervisor):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [2.5 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    with pytest.raises(DeviceError, match=r"faster than its limit of 3 rad/s; it was not sent"):
        for k in range(1, 100):  # the counter goes on twice as fast as the time
            step(supervisor, 100 + k, 10.0 + 0.5 * k / RATE)
            for stream, reading in zip(supervisor.checks.streams, row(100 + k).drives, strict=True):
                stream.begin(reading, 10.0 + 0.5 * k / RATE)
    assert supervisor.trackers[0].sent < 0.1


def follow(supervisor, k):
    """Send what is due at a sample, and take the sample; return the hip's set-point."""
    now = 10.0 + (k - 100) / RATE
    sent = step(supervisor, k, now)[0]
    for stream, reading in zip(supervisor.checks.streams, row(k).drives, strict=True):
        stream.begin(reading, now)
    return sent


def told(reference, velocity=np.nan, enabled=True, sequence=0):
    return Reading(sequence, 0.0, reference, 0.0, 0.0, velocity, 20.0, reference, enabled=enabled)


@pytest.mark.parametrize("gone_on", [0.0, 0.01, 0.03])
def test_after_missed_samples_set_points_walk_back_to_the_plan_gently_from_where_the_drive_is(
    supervisor, gone_on
):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [1.5 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    before = follow(supervisor, 101)
    assert supervisor.has_missed(106, 10.0 + 6 / RATE)
    supervisor.resume(0, told(before + gone_on, sequence=106), 10.0 + 6 / RATE)
    sent = np.array([before + gone_on, *(follow(supervisor, k) for k in range(106, 220))])
    speed, plan = RATE * np.diff(sent), np.arange(106, 220) * 1.5 / RATE - 150 / RATE
    a = supervisor.rig.safety.deceleration_rad_s2
    assert (
        np.abs(np.diff([supervisor_speed_before(before, gone_on), *speed])).max() <= a / RATE + 1e-9
    )
    assert speed.max() <= 0.8 * 3.0 + 1e-9  # short of the speed limit
    assert (sent[1:] - plan).max() <= 2.0 * a / RATE**2, "it does not overshoot"
    assert sent[-1] == pytest.approx(plan[-1], abs=1e-12), "the plan again"


@pytest.mark.parametrize("on_by", [0, 1])
def test_a_drive_that_followed_the_plan_through_a_silence_is_led_on_a_sample_later(
    supervisor, on_by
):
    path = np.arange(1, 129)[:, np.newaxis] * [1.5 / RATE, 0.0]
    supervisor.load_plan(Plan(path, 50, 100), np.zeros(2))
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    for k in range(101, 111):
        follow(supervisor, k)
    now = 10.0 + 13 / RATE
    assert supervisor.has_missed(113, now)
    # At sample n the set-point is reached that was sent at the one before.
    supervisor.resume(0, told(path[113 + on_by - 102][0], velocity=1.5, sequence=113 + on_by), now)
    sent = [follow(supervisor, k) for k in range(113, 120)]
    assert sent == pytest.approx(path[113 - 101 : 120 - 101, 0], abs=1e-9)


def test_set_points_that_are_left_out_are_counted_and_told_with_the_limit_that_is_broken_then(
    supervisor,
):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [1.5 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    follow(supervisor, 101)
    assert supervisor.left_out == 0
    supervisor.advance(105, 10.0 + 5 / RATE)
    assert supervisor.left_out == 3
    assert "set-points were missed before it" in supervisor.checks.streams[0].after_jerk(
        "too much", row(105).drives[0]
    )


def test_a_cuff_that_is_pressed_after_one_drive_was_told_nothing_is_told_so_whichever_drive_it_was(
    supervisor,
):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [1.5 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    follow(supervisor, 101)
    supervisor.checks.streams[1].leave_out(98, 100)
    pressed = np.where([[True], [False], [False], [False]], 401.0, np.nan) * np.ones(3)
    with pytest.raises(
        DeviceError, match=r"thigh_front force x 401 N .*; samples or set-points were missed"
    ):
        supervisor.check_answers(Answers((LOST, LOST), pressed, None), 10.0 + 1 / RATE)


def test_what_is_due_at_a_sample_is_due_no_more_once_the_next_one_is_there(supervisor):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [1.5 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    assert not supervisor.is_late(10.0), "nothing is followed yet"
    supervisor.begin(row(100), 10.0)
    supervisor.advance(101, 10.0 + 1 / RATE)
    assert not supervisor.is_late(10.0 + 1.9 / RATE)
    assert supervisor.is_late(10.0 + 2.1 / RATE)


def supervisor_speed_before(before, gone_on):
    """Return how fast (rad/s) the drive is found to move: between rest and the plan's own speed."""
    return min(gone_on / (5 / RATE), 1.5) if before else 0.0


def test_a_set_point_that_comes_soon_after_a_late_one_leads_back_to_the_plan_no_faster(supervisor):
    """For the drive both fall into one of its samples."""
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [2.0 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    before = follow(supervisor, 101)
    assert supervisor.has_missed(111, 10.0 + 11 / RATE)
    supervisor.resume(0, told(before, sequence=111), 10.0 + 11 / RATE)
    late = 10.0 + 11.8 / RATE
    first = step(supervisor, 111, late)[0]
    soon = step(supervisor, 112, late + 0.2 / RATE)[0]
    assert 0.0 < soon - first < 0.5 * (first - before)


@pytest.mark.parametrize("tells", [True, False])
def test_a_drive_that_went_on_while_it_was_led_back_to_a_standing_plan_is_found_where_it_is(
    tmp_path, tells
):
    """The plan stands, so that nothing is left to be slowed down; the drive moves all the same."""
    text = (datasets() / "rigs" / "real_time.toml").read_text()
    register = 'reference = { address = 110, type = "int32", scale = 1e-6, unit = "rad" }'
    assert register in text
    (tmp_path / "rig.toml").write_text(text if tells else text.replace(register, ""))
    supervisor = Supervisor(load_rig(tmp_path / "rig.toml"), RATE)
    supervisor.start_checks()
    supervisor.load_plan(Plan(np.full((128, 2), [0.2, 0.0]), 50, 100), np.array([0.2, 0.0]))
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    supervisor.trackers[0].start_at(0.1)
    step(supervisor, 101, 10.0 + 1 / RATE)
    at = 10.0 + 4 / RATE
    assert supervisor.trackers[0].is_stale(at)
    assert not supervisor.trackers[1].is_stale(at), "it is held"
    sent = supervisor.trackers[0].sent
    moved = 2.0 * (sent - 0.1)
    supervisor.resume(0, told(sent + moved, sequence=104), at)
    assert supervisor.trackers[0].base == pytest.approx(sent + moved)


def test_a_run_that_lags_too_far_behind_its_plan_is_stopped(supervisor):
    supervisor.load_plan(
        Plan(np.arange(1, 129)[:, np.newaxis] * [2.9 / RATE, 0.0], 50, 100), np.zeros(2)
    )
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    with pytest.raises(
        DeviceError, match=r"hip: its set-points are 0\.\d+ rad behind .* allowed are 0\.750 rad"
    ):
        for k in range(110, 300, 10):
            follow(supervisor, k)


@pytest.mark.parametrize(("velocity", "moves"), [(0.0, False), (1.5, True), (np.nan, True)])
def test_a_stop_after_a_silence_begins_where_the_drive_is_and_as_fast_as_it_is(
    supervisor, velocity, moves
):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    supervisor.trackers[0].start_at(0.2)
    supervisor.trackers[0]._speed = 2.0
    supervisor.abort(DeviceError("silent"))
    supervisor.resume(0, told(0.4, velocity), 10.25)
    path = []
    while due := supervisor.safe_stop.set_point(0, 10.25 + len(path) / RATE):
        path.append(due[0])
    fastest = 0.8 if np.isnan(velocity) else velocity  # as fast as it went meanwhile
    assert path[0] - 0.4 == pytest.approx(max(fastest - 0.5 * 8.0 / RATE, 0.0) / RATE)
    assert path[-1] - 0.4 == pytest.approx(fastest**2 / 2 / 8.0)
    assert (path[-1] > 0.4) == moves


def test_a_leg_that_does_not_follow_stops_the_run(supervisor):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    with pytest.raises(
        DeviceError, match=r"hip angle 0\.000 rad is 0\.15\d rad from its set-point of 0\.15\d rad"
    ):
        for k in range(101, 200):  # the leg hangs and trembles, the plan goes on
            step(supervisor, k, 10.0 + (k - 100) / RATE)
            supervisor.check_answers(answers(row(k, 1e-4 * (k % 2))), 10.0 + (k - 100) / RATE)
    assert supervisor.trackers[0].sent < 0.16


def test_a_knee_that_does_not_follow_stops_the_run_though_the_hip_is_silent(supervisor):
    """The hip falls silent just before the knee's error reaches its limit."""
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    with pytest.raises(DeviceError, match=r"knee angle 0\.000 rad is 0\.1\d+ rad from its set"):
        for k in range(101, 172):
            now = 10.0 + (k - 100) / RATE
            step(supervisor, k, now)
            hip = row(k, 0.0025 * (k - 100)).drives[0] if k < 158 else LOST
            knee = row(k, 1e-4 * (k % 2)).drives[1]
            found = None if hip is LOST else Row((hip, knee), row(k).forces)
            supervisor.check_answers(Answers((hip, knee), row(k).forces, found), now)
    assert hip is LOST


def test_a_drive_that_is_not_enabled_is_told_nothing_on_the_way_to_rest(supervisor):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    assert supervisor.safe_stop.set_point(0, 10.1)
    with pytest.raises(DeviceError, match="is no longer enabled"):
        supervisor.enable_states[0].enabled = True
        supervisor.safe_stop.check(0, told(0.0, 0.0, enabled=False))
    assert supervisor.safe_stop.set_point(0, 10.2) is None


@pytest.mark.parametrize("word", [{"enabled": False}, {"enabled": True, "fault": "overheated"}])
def test_a_drive_that_let_go_of_its_leg_is_told_nothing_though_it_says_that_it_is_enabled_again(
    supervisor, word
):
    enable(supervisor)
    supervisor.begin(row(100), 10.0)
    supervisor.enable_states.update(0, DriveStatus(enabled=True))
    with pytest.raises(DeviceError, match=r"is no longer enabled|overheated"):
        supervisor.enable_states.update(0, DriveStatus(**word))
    supervisor.enable_states.update(0, DriveStatus(enabled=True))
    assert supervisor.safe_stop.set_point(0, 10.2) is None


@pytest.mark.parametrize(
    ("kind", "what", "words"),
    [
        ("counter", 7, "its sample counter leapt"),
        ("counter", -7, "its sample counter went back"),
        ("freeze", None, "its sample counter stands still"),
    ],
)
@pytest.mark.parametrize("joint", [0, 1])
def test_of_two_counters_that_part_the_one_that_did_it_is_named(tmp_path, kind, what, words, joint):
    run = RunSettings(name="x", run="exo_alone", purpose="train", duration_s=0.5)
    at = 100 + joint
    events = [Event(at, kind, what)]
    simulated = simulate(
        RIGS["lockstep", True, FINE_RAD, None],
        run,
        TRAJECTORY,
        tmp_path / "x.parquet",
        events,
        REST_RAD,
    )
    why = simulated.supervisor.why
    assert why.startswith(f"drive {('hip', 'knee')[joint]} (127.0.0.1:502, unit {joint + 1}): ")
    assert words in why
