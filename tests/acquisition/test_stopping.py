"""A stop heeds what the drives tell meanwhile, and what they told before it that nobody had come to
judge."""

import asyncio
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.stopping import Stopping
from pipelines.errors import DeviceError
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.simulated import RATE, Event, simulate
from tests.acquisition.test_invariants import (
    FINE_RAD,
    LINES,
    REST_RAD,
    RIGS,
    SOON_S,
    TRAJECTORY,
    a_drive_that_says_it_is_not_enabled_is_told_to_disable_and_nothing_else,
    no_drive_leaps,
)

RUN = RunSettings(name="x", run="exo_alone", purpose="train", duration_s=0.5)


def run_with(tmp_path, *events, line=None, trajectory=TRAJECTORY):
    """Run on drives that read back and go on for a while when they are told nothing."""
    path = tmp_path / "x.parquet"
    return simulate(
        RIGS["real_time", True, FINE_RAD, line],
        RUN,
        trajectory,
        path,
        list(events),
        REST_RAD,
        goes_on=True,
    )


def times(share):
    """Return a slower motion: after a silence these drives are where they are told within a
    sample."""
    return replace(TRAJECTORY, a=share * TRAJECTORY.a, b=share * TRAJECTORY.b)


@pytest.mark.parametrize(
    ("joint", "found"),
    [
        (0, {"torque": 151.0}),
        (1, {"torque": -111.0}),
        (1, {"torque": np.nan}),
        (0, {"angle": 0.16}),
        (1, {"angle": -0.16}),
        (0, {"angle": np.nan}),
    ],
)
def test_a_stop_lets_go_of_a_leg_that_is_pressed_or_does_not_follow(joint, found):
    supervisor = Supervisor(load_rig(datasets() / "rigs" / "real_time.toml"), 200.0)
    supervisor.start_checks()
    supervisor.load_plan(Plan(np.zeros((200, 2)), 50, 150), np.zeros(2))
    supervisor.abort(DeviceError("made up"))
    at_rest = Reading(0, 0.0, 0.0, 0.0, 0.0, 0.0, 20.0, 0.0, enabled=True)
    supervisor.safe_stop.check(joint, at_rest)
    assert supervisor.safe_stop.set_point(joint, 10.0) == (0.0, True)
    supervisor.safe_stop.check(joint, Reading(**{**vars(at_rest), **found}))
    assert supervisor.safe_stop.set_point(joint, 10.1) is None


@pytest.mark.parametrize("at", range(150, 162))
def test_a_drive_that_said_beside_anothers_failure_that_it_is_not_enabled_is_told_disable_alone(
    tmp_path, at
):
    run = run_with(tmp_path, Event(at, "power"), Event(at, "raise", lambda: DeviceError("made up")))
    assert run.supervisor.why
    a_drive_that_says_it_is_not_enabled_is_told_to_disable_and_nothing_else(run)


def test_a_signal_is_heeded_while_a_drive_is_waited_for_that_does_not_say_it_is_enabled(tmp_path):
    run = run_with(tmp_path, Event(1, "power"), Event(100, "signal"))
    assert any(told.control == run.rig.rig.map.drive["servo"].enable for told in run.rig.told)
    assert run.supervisor.why == "stopped by SIGTERM"


@pytest.mark.parametrize("at", range(125, 205, 5))
def test_a_drive_that_went_on_through_a_silence_is_stopped_from_where_it_is(tmp_path, at):
    run = run_with(tmp_path, Event(at, "dead", 30))
    assert run.supervisor.why
    no_drive_leaps(run)


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("at", range(125, 240, 5))
def test_a_drive_beside_a_silent_one_is_told_where_to_go_all_the_time(tmp_path, line, at):
    run = run_with(tmp_path, Event(at, "dead", 30), line=line, trajectory=times(0.2))
    silent = "drive knee" in run.supervisor.why
    told = [told.time for told in run.rig.told if told.joint != silent and told.control]
    reply_s = run.rig.rig.safety.longest_reply_s if line else 0.0
    assert max(np.diff(told)) <= 2 / RATE + reply_s + SOON_S
    moved = np.diff(
        [told.reference for told in run.rig.told if told.joint != silent and told.control]
    )
    assert moved[-1] == 0.0  # it has come to rest by then


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("kind", ["lost", "no answer"])
@pytest.mark.parametrize("at", range(125, 240, 7))
def test_a_run_goes_on_after_one_lost_reply_though_the_other_drive_was_slowed_down(
    tmp_path, line, kind, at
):
    run = run_with(tmp_path, Event(at, kind), line=line, trajectory=times(0.1))
    assert run.supervisor.why is None
    # reply_s is three samples; on a shared line the device is not asked again for as long.
    assert run.result.missed <= (7 if line else 4)
    no_drive_leaps(run)


@pytest.mark.parametrize("at", range(150, 220))
def test_a_stop_leaves_no_sample_of_a_drive_without_a_set_point(tmp_path, monkeypatch, at):
    """Else it goes on by itself for a sample, and is led back with a jerk; replies take a fifth of
    a sample here."""
    took_s = 0.2 / RATE
    monkeypatch.setattr("tests.acquisition.simulated.LATENCY_S", took_s)
    run = run_with(tmp_path, Event(at, "signal"))
    assert run.supervisor.why == "stopped by SIGTERM"
    for joint in range(2):
        told = [told for told in run.rig.told if told.joint == joint and told.control]
        sample = [
            int((one.time + took_s - run.rig.began) * RATE)
            for one in told
            if one.time >= run.aborted_at
        ]
        assert len(sample) >= 20
        assert set(np.diff(sample)) == {1}


class Cuff:
    """A cuff's sensor that fails, or that answers with a force."""

    def __init__(self, cuff, answer):
        self.settings, self.answer = SimpleNamespace(cuff=cuff), answer

    async def look(self):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.mark.parametrize("force", [(0.0, 0.0, 900.0), None])
def test_a_failed_sensor_does_not_end_the_watch_of_the_other_cuffs(force):
    """The failure is reported; a cuff that presses lets go of the leg all the same."""
    failed = DeviceError("sensor thigh_front does not answer")
    machine = SimpleNamespace(
        drives=(),
        no_force=np.full((4, 3), np.nan),
        sensors=[Cuff("thigh_front", failed), Cuff("shank_back", force)],
    )
    machine.by_cuff = partial(Machine.by_cuff, machine)
    supervisor = SimpleNamespace(rate=1000.0, pressing=False, reasons=[])
    supervisor.abort = supervisor.reasons.append

    def check_cuffs(forces):
        assert np.isnan(forces[:3]).all()
        supervisor.pressing = bool(np.nanmax(forces[3], initial=0.0) > 100.0)

    supervisor.safe_stop = SimpleNamespace(check_cuffs=check_cuffs)
    stopping = Stopping(SimpleNamespace(machine=machine), supervisor, [], lambda: None)

    async def watch():
        watching = asyncio.ensure_future(stopping._watch_cuffs())
        await asyncio.sleep(0.05)
        stopping._has_ended = True
        watching.cancel()
        await asyncio.wait([watching])

    asyncio.run(watch())
    assert supervisor.pressing == (force is not None)
    assert supervisor.reasons == [failed]
