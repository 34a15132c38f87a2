"""The safety state machine itself: as it is drawn, and what may not be skipped."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipelines.acquisition.machine import Reading, Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.states import TRANSITIONS, State, Supervisor
from pipelines.errors import DeviceError
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.simulated import Event, simulate
from tests.acquisition.test_invariants import REST_RAD, RIGS, TRAJECTORY

DRAWING = Path(__file__).parents[2] / "docs" / "safety.md"
RATE = 200.0


def test_the_drawing_has_the_transitions_of_the_code_and_no_others():
    arrows = re.findall(r"^    (\S+) --> (\S+)$", DRAWING.read_text(), flags=re.MULTILINE)
    drawn = {tuple(name.replace("_", " ") for name in arrow) for arrow in arrows}
    assert drawn == {(str(a), str(b)) for a, following in TRANSITIONS.items() for b in following} | {
        ("[*]", "idle"),
        ("disabled", "[*]"),
    }


def test_every_state_leads_to_rest():
    for state in State:
        if state not in (State.IDLE, State.DISABLED):
            assert State.ABORT in TRANSITIONS[state] or State.DISABLED in TRANSITIONS[state]


@pytest.fixture
def supervisor():
    supervisor = Supervisor(load_rig(datasets() / "rigs" / "real_time.toml"), RATE)
    supervisor.check()
    supervisor.take(Plan(np.linspace(0.0, 0.5, 200)[:, np.newaxis] * [1.0, -1.0], 50, 150), np.zeros(2))
    return supervisor


def row(sequence):
    at_rest = Reading(sequence, sequence / RATE, 0.0, 0.0, 0.0, 0.0, 20.0, 0.0, enabled=True)
    return Row((at_rest, at_rest), np.full((4, 3), np.nan))


def test_a_state_cannot_be_skipped(supervisor):
    with pytest.raises(AssertionError, match="there is no way from check to run"):
        supervisor._go(State.RUN)


def test_after_an_abort_no_set_point_of_the_plan_follows_and_the_first_reason_stays(supervisor):
    supervisor.rest(10.0)
    supervisor.begin(row(100), 10.0)
    supervisor.next(101, 10.005)
    supervisor.abort(DeviceError("the first"))
    supervisor.abort(ValueError("the second"))
    assert (supervisor.state, supervisor.why) == (State.ABORT, "the first")
    assert isinstance(supervisor.fault, ValueError)
    for ask in (lambda: supervisor.next(102, 10.01), lambda: supervisor.judge(row(102), 10.01)):
        with pytest.raises(DeviceError, match="the first"):
            ask()


def test_many_small_leaps_of_a_counter_do_not_add_up_to_a_speed_above_the_limit(supervisor):
    supervisor.take(Plan(np.arange(1, 129)[:, np.newaxis] * [2.5 / RATE, 0.0], 50, 100), np.zeros(2))
    supervisor.rest(10.0)
    supervisor.begin(row(100), 10.0)
    with pytest.raises(DeviceError, match=r"faster than its limit of 3 rad/s; it was not sent"):
        for k in range(1, 100):  # each cycle the counter goes on by two
            supervisor.next(100 + 2 * k, 10.0 + k / RATE)
            supervisor._watch._last = row(100 + 2 * k)
            supervisor._watch._fresh = 10.0 + k / RATE
    assert supervisor.sent[0] < 0.1


@pytest.mark.parametrize(
    ("kind", "what", "words"),
    [("counter", 7, "its sample counter leapt"), ("counter", -7, "its sample counter went back"),
     ("freeze", None, "its sample counter stands still")],
)  # fmt: skip
@pytest.mark.parametrize("joint", [0, 1])
def test_of_two_counters_that_part_the_one_that_did_it_is_named(tmp_path, kind, what, words, joint):
    run = RunSettings(name="x", run="exo_alone", purpose="train", duration_s=0.5)
    at = 100 + joint
    events = [Event(at, kind, what)]
    why = simulate(RIGS["lockstep", True], run, TRAJECTORY, tmp_path / "x.parquet", events, REST_RAD).supervisor.why
    assert why.startswith(f"drive {('hip', 'knee')[joint]} (127.0.0.1:502, unit {joint + 1}): ")
    assert words in why
