"""What holds whatever happens: random sequences of faults and operator's actions on a simulated rig."""

import asyncio
import itertools
import tempfile
from dataclasses import dataclass
from math import ceil, inf
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from pipelines.acquisition.acquire import Outcome
from pipelines.acquisition.loop import DISABLE_TRIES
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety import HOLD_SAMPLES
from pipelines.acquisition.states import TRANSITIONS, State
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, ExoidError
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings
from tests.acquisition.simulated import RATE, Event, simulate

FINE_RAD, COARSE_RAD = 1e-6, 0.01
"""Counts of the set-point's register: six of the coarse ones make the longest step, four would be allowed."""
NOTHING_RAD = 1e-9
SOON_S = 0.005
"""Within which several requests are answered."""
REST_RAD = (0.6, -0.8)
TRAJECTORY = FourierTrajectory(
    np.array(REST_RAD), np.array([[0.16, 0.02], [-0.13, 0.02]]), np.array([[0.05, -0.03], [0.11, 0.02]]), 4 * np.pi
)
"""Fast: nearly at the speed limit."""
REGISTERS = {
    "sequence": ("uint32", "1", 1.0), "time": ("float64", "s", 1.0), "angle": ("float64", "rad", 1.0),
    "velocity": ("float64", "rad/s", 1.0), "current": ("float64", "A", 1.0), "reference": ("float64", "rad", 1.0),
    "temperature": ("float64", "°C", 1.0), "status": ("uint16", "1", 1.0),
}  # fmt: skip


def rig_that(clock, *, reads_back=True, count_rad=FINE_RAD, line=None):
    """Return a rig of two drives and two cuff sensors, on one ``line`` of a kind or each on its own."""
    shared = {"line": {"leg": {"transport": line}}} if line else {}
    on_it = {"line": "leg"} if line else {}
    read = {
        name: {"address": 100 + 4 * k, "type": kind, "unit": unit, "scale": scale}
        for k, (name, (kind, unit, scale)) in enumerate(REGISTERS.items())
    }
    write = {
        "reference": {"address": 200, "type": "int32", "scale": count_rad, "unit": "rad"},
        "control": {"address": 202, "type": "uint16"},
    }
    servo = {"read": read, "write": write, "enable": 15, "halt": 271, "fault_mask": 8}
    if reads_back:
        servo |= {"enabled_mask": 1, "enabled_value": 1}
    force = {
        name: {"address": 100 + 4 * k, "type": "uint32" if name == "sequence" else "float64", "unit": unit}
        for k, (name, unit) in enumerate({"sequence": "1", "force_x": "N", "force_y": "N", "force_z": "N"}.items())
    }
    drive = {"map": "servo", "torque_constant_nm_a": 0.12, "gear_ratio": 100.0, "torque_nm": 150.0, "speed_rad_s": 3.0}
    drive |= on_it
    return RigSettings.model_validate({
        "name": "simulated",
        "clock": clock,
        "drive": [
            drive | {"joint": "hip", "unit": 1, "angle_rad": (-0.35, 1.75)},
            drive | {"joint": "knee", "unit": 2, "angle_rad": (-2.1, 0.35)},
        ],
        "sensor": [
            {"cuff": "thigh_front", "unit": 11, "map": "force"} | on_it,
            {"cuff": "shank_back", "unit": 12, "map": "force"} | on_it,
        ],
        "map": {"drive": {"servo": servo}, "sensor": {"force": {"read": force}}},
        "safety": {"watchdog_s": 0.2, "ramp_s": 0.3, "settle_s": 0.1, "deceleration_rad_s2": 8.0},
        "plant": {},
        **shared,
    })  # fmt: skip


LINES = (None, "tcp", "rtu_over_tcp")
RIGS = {
    (clock, reads_back, count_rad, line): rig_that(clock, reads_back=reads_back, count_rad=count_rad, line=line)
    for clock in ("real_time", "lockstep")
    for reads_back in (True, False)
    for count_rad in (FINE_RAD, COARSE_RAD)
    for line in LINES
}


def raised(*kinds):
    return st.sampled_from(kinds).map(lambda kind: lambda: kind("made up"))


anything = raised(
    DeviceError, OSError, ValueError, ZeroDivisionError, MemoryError, AssertionError, RecursionError, KeyboardInterrupt,
    SystemExit, asyncio.CancelledError, TimeoutError,
)  # fmt: skip
wild = st.sampled_from([np.nan, np.inf, -np.inf, 1e9, -50.0, 2.0])
happenings = st.one_of(
    st.tuples(st.just("raise"), anything),
    st.tuples(st.just("late"), st.floats(0.0, 0.06)),
    st.tuples(st.sampled_from(["lost", "no answer", "freeze", "fault", "status", "power"]), st.none()),
    st.tuples(st.sampled_from(["signal", "cancel", "interrupt"]), st.none()),
    st.tuples(st.sampled_from(["dead", "broken"]), st.integers(1, 30)),
    st.tuples(st.just("counter"), st.integers(-12, 12) | st.integers(-200, 200)),
    st.tuples(st.just("clock"), st.floats(-3.0, 3.0)),
    st.tuples(st.just("reading"), st.tuples(st.sampled_from(["angle", "current", "velocity"]), wild)),
    st.tuples(st.just("force"), wild),
)


silences = st.one_of(
    st.tuples(st.just("late"), st.floats(0.0, 0.06)),
    st.tuples(st.sampled_from(["lost", "no answer"]), st.none()),
    st.tuples(st.just("raise"), raised(DeviceError)),
    st.tuples(st.just("dead"), st.integers(1, 12)),
    st.tuples(st.just("counter"), st.integers(-3, 3)),
)


@st.composite
def sequences_of(draw, happen, most, apart):
    """Return events that begin anywhere in a run and then follow each other closely, into the stop and its end."""
    at, events = draw(st.integers(1, 420)), []
    for kind, what in draw(st.lists(happen, max_size=most)):
        events.append(Event(at, kind, what))
        at += draw(st.integers(0, apart))
    return events


own_errors = st.none() | st.tuples(st.sampled_from(["report", "journal", "keep"]), st.integers(1, 60), anything)


@dataclass(frozen=True)
class Spoil:
    """Makes a plan that nobody should have made: it leaps, leaves the limits, or is no number."""

    at: int
    length: int
    joint: int
    value: float

    def __call__(self, plan):
        reference = np.array(plan.reference)
        reference[self.at : self.at + self.length, self.joint] = self.value
        return Plan(reference, plan.first, plan.stop)


bad_plans = st.builds(Spoil, st.integers(0, 60), st.integers(1, 10), st.integers(0, 1), wild)


def check_every_invariant(clock, reads_back, count_rad, line, goes_on, human, happens, plan, own):
    rig = RIGS[clock, reads_back, count_rad, line]
    run = RunSettings(name="x", run="with_human" if human else "exo_alone", purpose="train", duration_s=0.5)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.parquet"
        simulated = simulate(rig, run, TRAJECTORY, path, happens, REST_RAD, plan=plan, own=own, goes_on=goes_on)
        sent_is_within_limits(simulated)
        no_drive_leaps(simulated)
        a_drive_that_says_it_is_not_enabled_is_told_to_disable_and_nothing_else(simulated)
        motion_stops_within_the_stated_number_of_cycles(simulated)
        a_leg_is_slowed_down_before_its_torque_is_taken_away(simulated)
        a_stop_goes_on_in_step_with_its_drives_samples(simulated)
        no_drive_that_answers_is_told_nothing_for_long(simulated)
        the_abort_is_told(simulated, folder)
        drives_are_disabled_or_it_is_said_that_they_are_not(simulated)
        only_drawn_transitions_were_made(simulated)


@pytest.mark.parametrize("reads_back", [True, False])
@pytest.mark.parametrize("count_rad", [FINE_RAD, COARSE_RAD])
@pytest.mark.parametrize("ahead", [1, 2, 3])
def test_a_run_ends_though_one_drives_counter_has_parted_from_the_others(reads_back, count_rad, ahead):
    """Each cycle then waits for the slower one, and misses samples all along."""
    parting = [Event(77 + 2 * k, "counter", 1) for k in range(ahead)]
    check_every_invariant("real_time", reads_back, count_rad, "tcp", True, False, parting, None, None)


def rounding_of(run):
    """Return by how much rounding lengthens a step at most, rad."""
    return run.rig.rig.map.drive["servo"].write.reference.step + NOTHING_RAD


def sent_is_within_limits(run):
    """As docs/safety.md states it: between any two set-points of a joint, not only between neighbours."""
    rig = run.rig.rig
    for j, drive in enumerate(rig.drive):
        mine = [told for told in run.rig.told if told.joint == j]
        if not mine:
            continue
        sent, at = np.array([(told.reference, told.time) for told in mine]).T
        low, high = drive.angle_rad
        assert low - NOTHING_RAD <= sent.min() and sent.max() <= high + NOTHING_RAD
        # In lockstep cycles are the time.
        time_s = np.arange(len(at)) / RATE if rig.clock == "lockstep" else 1.05 * at
        allowed_s = np.abs(time_s - time_s[:, np.newaxis]) + 2.0 / RATE
        assert (np.abs(sent - sent[:, np.newaxis]) <= drive.speed_rad_s * allowed_s + rounding_of(run)).all()
        # After a silence they begin anew from where the drive is: one that holds is where it was told last.
        if not run.rig.goes_on and not run.rig.drives[j].was_without_torque:
            before = is_at = REST_RAD[j]
            for told in mine:
                step = min(abs(told.reference - before), abs(told.reference - is_at))
                assert step <= drive.speed_rad_s / RATE + rounding_of(run)
                before, is_at = told.reference, told.reference if told.arrived else is_at


def no_drive_leaps(run):
    """As docs/safety.md states it: from where a drive is, whatever it made of a silence and of what never arrived.

    Of a drive that cannot say that it has lost its power only its leg tells, by how far it does not follow.
    """
    safety, tells = run.rig.rig.safety, run.rig.rig.map.drive["servo"].enabled_mask
    for drive in run.rig.drives:
        unseen_rad = safety.following_error_rad if drive.was_without_torque and not tells else 0.0
        assert drive.largest_leap <= 3.0 * drive.settings.speed_rad_s / RATE + unseen_rad + rounding_of(run)


def a_drive_that_says_it_is_not_enabled_is_told_to_disable_and_nothing_else(run):
    """It may be enabled by the very level of its control word, once the emergency stop is released."""
    if run.rig.rig.map.drive["servo"].enabled_mask:
        assert all(told.control == 0 for told in run.rig.told if told.after_idle)


def motion_stops_within_the_stated_number_of_cycles(run):
    """As docs/safety.md states it."""
    if run.aborted_at is None:
        return
    for j, drive in enumerate(run.rig.rig.drive):
        told = [t for t in run.rig.told if t.joint == j and t.control != 0]
        before = [t.reference for t in told if t.time <= run.aborted_at]
        after = [t.reference for t in told if t.time > run.aborted_at]
        moving = np.flatnonzero(np.abs(np.diff(before[-1:] + after)) > NOTHING_RAD)
        slowing = ceil(drive.speed_rad_s / run.rig.rig.safety.deceleration_rad_s2 * RATE)
        assert moving.size == 0 or moving[-1] < slowing
        assert len(after) <= slowing + HOLD_SAMPLES


def a_leg_is_slowed_down_before_its_torque_is_taken_away(run):
    """Whatever the reason to stop, wherever its drive answers soundly, is enabled, and nobody is pressed."""
    if run.aborted_at is None or run.supervisor.pressing or any(at >= run.aborted_at for at, _ in run.rig.raised):
        return
    for drive in run.rig.drives:
        mine = [asked for asked in run.rig.asked if drive.settings.joint in asked.label]
        late = (asked for asked in mine if not asked.was_answered_by(asked.time + SOON_S))
        silent = any(asked.answered > run.aborted_at for asked in late)
        said_wrong = drive.wrong or drive.fault or drive.unpowered or drive.stuck_status or drive.was_without_torque
        told = [t.reference for t in run.rig.told if t.joint == drive.joint and t.control != 0]
        if told and not silent and not said_wrong:
            assert len(told) >= HOLD_SAMPLES
            # After a silence it is held where its drive is found.
            assert len(set(told[-HOLD_SAMPLES // 2 :])) == 1


def a_stop_goes_on_in_step_with_its_drives_samples(run):
    """Else a drive that is told nothing for one goes on by itself, and is led back with a jerk."""
    rig = run.rig.rig
    if run.aborted_at is None or rig.clock == "lockstep" or rig.line:
        return
    for drive in run.rig.drives:
        mine = [asked for asked in run.rig.asked if drive.settings.joint in asked.label]
        if any(asked.answered > run.aborted_at and not asked.was_answered_by(asked.time + SOON_S) for asked in mine):
            continue
        told = [t.time for t in run.rig.told if t.joint == drive.joint and t.control != 0 and t.time > run.aborted_at]
        in_step = np.arange(len(told)) / RATE
        assert (np.abs(np.array(told) - (told or [0.0])[0] - in_step) <= 0.5 / RATE + 1e-9).all()


def no_drive_that_answers_is_told_nothing_for_long(run):
    """As docs/safety.md states it, from the first set-point that moves it until it is told to disable."""
    for drive in run.rig.drives if run.rig.rig.clock == "real_time" else ():
        told = [t for t in run.rig.told if t.joint == drive.joint and t.time >= run.followed_since]
        disabled = next((k for k, t in enumerate(told) if t.control == 0), len(told))
        for one, other in itertools.pairwise(told[: disabled + 1]):
            longest, silent = longest_alone(run, drive.settings.joint, one.time, other.time)
            if silent <= 1:
                assert other.time - one.time <= longest


def longest_alone(run, joint, begin, end):
    """Return for how long (s) a joint's drive may be told nothing between instants, and beside how many silent others.

    As long as you like where it does not answer itself.
    """
    asked = [asked for asked in run.rig.asked if asked.time <= end and not asked.was_answered_by(begin)]
    late = [asked for asked in asked if not asked.was_answered_by(asked.time + SOON_S)]
    silent = {asked.label for asked in late if asked.answered == inf}
    if any(f"drive {joint}" in asked.label for asked in late):
        return inf, len(silent)
    waited_s = len(silent) * run.rig.rig.safety.longest_reply_s
    waited_s += sum(asked.answered - asked.time for asked in late if asked.answered < inf)
    return 2 / RATE + SOON_S + (waited_s if run.rig.rig.line else 0.0), len(silent)


def the_abort_is_told(run, folder):
    supervisor, result = run.supervisor, run.result
    if not any(told.control != 0 for told in run.rig.told):
        # Refused before anything was enabled: what was raised went to the caller as it was.
        assert isinstance(result, ExoidError | asyncio.CancelledError) or any(result is e for _, e in run.rig.raised)
        return
    if run.first_reason is not None:
        assert supervisor.why.startswith(run.first_reason)
        assert all(also in supervisor.why for also in supervisor.also)
    if supervisor.why is None:
        assert isinstance(result, Outcome)
        assert RECORDING.read(result.path).metadata.get("abort") is None
        assert only_disabling_failed(run)
        return
    assert isinstance(result, ExoidError), repr(result)
    assert supervisor.why in str(result)
    assert result.exit_code == (1 if supervisor.fault else 3)
    for aborted in Path(folder).glob("*.parquet"):
        assert RECORDING.read(aborted).metadata["abort"] == supervisor.why
    assert bool(supervisor.fault) == bool(list(Path(folder).glob("*.log")))


def only_disabling_failed(run):
    """Tell whether what was raised befell nothing but attempts to disable, the last of which went through."""
    enabled = min(t.time for t in run.rig.told if t.control != 0)
    first = min(t.time for t in run.rig.told if t.control == 0 and t.time > enabled)
    return all(at >= first for at, _ in run.rig.raised)


def drives_are_disabled_or_it_is_said_that_they_are_not(run):
    for drive in run.rig.drives:
        if drive.control == 0:
            continue
        assert run.rig.failed_to_disable[drive.joint] >= DISABLE_TRIES
        assert f"could not be disabled: drive {drive.settings.joint}" in run.supervisor.why.replace(
            "; drive", ": drive"
        ) or ("could not be disabled" in run.supervisor.why and drive.settings.joint in run.supervisor.why)
        assert "USE THE EMERGENCY STOP" in str(run.result)


def only_drawn_transitions_were_made(run):
    for before, after in zip(run.states, run.states[1:], strict=False):
        assert after in TRANSITIONS[before]
    if any(told.control != 0 for told in run.rig.told):
        assert run.states[-1] in (State.DISABLED, State.ABORT)


sequences = given(
    clock=st.sampled_from(["real_time", "lockstep"]), reads_back=st.booleans(),
    count_rad=st.sampled_from([FINE_RAD, COARSE_RAD]), line=st.sampled_from(LINES),
    goes_on=st.booleans(), human=st.booleans(), happens=sequences_of(happenings, 6, 60),
    plan=st.none() | bad_plans, own=own_errors,
)  # fmt: skip
relaxed = dict(deadline=None, suppress_health_check=list(HealthCheck))


@example(
    clock="lockstep", reads_back=True, count_rad=FINE_RAD, line=None, goes_on=False, human=False,
    happens=[Event(at=87, kind="dead", what=6)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=False, human=True,
    happens=[Event(at=263, kind="dead", what=5), Event(at=280, kind="cancel", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=True, human=True,
    happens=[Event(at=197, kind="late", what=0.0), Event(at=204, kind="counter", what=-2),
             Event(at=204, kind="late", what=0.0), Event(at=246, kind="lost", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=True, count_rad=FINE_RAD, line=None, goes_on=False, human=False,
    happens=[Event(at=40, kind="counter", what=1), Event(at=47, kind="status", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=False, human=False,
    happens=[Event(at=131, kind="power", what=None), Event(at=177, kind="power", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=True, count_rad=FINE_RAD, line=None, goes_on=False, human=False,
    happens=[Event(at=47, kind="fault", what=None), Event(at=47, kind="reading", what=("velocity", np.nan))],
    plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=True, human=True,
    happens=[Event(at=250, kind="late", what=0.0), Event(at=250, kind="late", what=0.0),
             Event(at=250, kind="lost", what=None), Event(at=255, kind="lost", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=True, human=False,
    happens=[Event(at=153, kind="late", what=0.046875), Event(at=163, kind="late", what=0.046875),
             Event(at=164, kind="lost", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=True, count_rad=FINE_RAD, line="tcp", goes_on=True, human=True,
    happens=[Event(at=135, kind="late", what=0.0), Event(at=135, kind="counter", what=1),
             Event(at=138, kind="counter", what=1), Event(at=143, kind="counter", what=1),
             Event(at=149, kind="lost", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=True, human=True,
    happens=[Event(at=198, kind="late", what=0.03125), Event(at=208, kind="lost", what=None),
             Event(at=217, kind="late", what=0.03125)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line=None, goes_on=False, human=True,
    happens=[Event(at=127, kind="counter", what=-3)], plan=Spoil(at=8, length=1, joint=0, value=2.0), own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=False, count_rad=FINE_RAD, line="tcp", goes_on=False, human=True,
    happens=[Event(at=330, kind="lost", what=None)], plan=None, own=None,
)  # fmt: skip
@example(
    clock="real_time", reads_back=True, count_rad=FINE_RAD, line=None, goes_on=False, human=True,
    happens=[Event(at=390, kind="raise", what=lambda: asyncio.CancelledError("made up"))], plan=None, own=None,
)  # fmt: skip
@sequences
@settings(max_examples=60, derandomize=True, **relaxed)
def test_whatever_happens_the_leg_is_stopped_within_its_limits_and_it_is_said_why(
    clock, reads_back, count_rad, line, goes_on, human, happens, plan, own
):
    check_every_invariant(clock, reads_back, count_rad, line, goes_on, human, happens, plan, own)


@pytest.mark.slow
@sequences
@settings(max_examples=10_000, database=None, **relaxed)
def test_ten_thousand_times_the_leg_is_stopped_within_its_limits_and_it_is_said_why(
    clock, reads_back, count_rad, line, goes_on, human, happens, plan, own
):
    check_every_invariant(clock, reads_back, count_rad, line, goes_on, human, happens, plan, own)


@pytest.mark.slow
@given(
    reads_back=st.booleans(), line=st.sampled_from(LINES), human=st.booleans(), happens=sequences_of(silences, 9, 12)
)
@settings(max_examples=10_000, database=None, **relaxed)
def test_ten_thousand_times_drives_that_go_on_by_themselves_are_led_from_where_they_are_however_silences_fall(
    reads_back, line, human, happens
):
    check_every_invariant("real_time", reads_back, FINE_RAD, line, True, human, happens, None, None)


def test_a_simulated_run_to_which_nothing_happens_is_complete(tmp_path):
    run = RunSettings(name="x", run="with_human", purpose="train", duration_s=0.5)
    for clock in ("real_time", "lockstep"):
        simulated = simulate(
            RIGS[clock, True, FINE_RAD, None], run, TRAJECTORY, tmp_path / f"{clock}.parquet", [], REST_RAD
        )
        assert isinstance(simulated.result, Outcome), simulated.result
        assert (simulated.result.samples, simulated.result.missed) == (25, 0)
        assert simulated.states == [
            State.IDLE, State.CHECK, State.RAMP, State.RUN, State.RAMP_DOWN, State.DISABLED,
        ]  # fmt: skip
        moved = {told.reference for told in simulated.rig.told}
        assert len(moved) > 80
