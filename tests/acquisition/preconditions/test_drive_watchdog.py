"""A lost reply, which a run survives, must not have a drive's own watchdog let go of the leg."""

import re

import numpy as np
import pytest

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.check.check import rate_findings
from pipelines.acquisition.preconditions.drive_watchdog import (
    refuse_short_heartbeat,
    replies_waited_for,
)
from pipelines.errors import SettingsError
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.conftest import free_port
from tests.acquisition.simulated import RATE, Event
from tests.acquisition.test_invariants import FINE_RAD, LINES, RIGS, SOON_S
from tests.acquisition.test_stopping import run_with, times

TCP = 'transport = "tcp"'
RTU = 'transport = "rtu"\nserial_port = "x"\nbaud_rate = 921600\nsilence_s = 0.0002'


@pytest.fixture
def with_line(rig_file):
    """Write the shipped rig in real time, with some of its devices on one line."""

    def write(table, *devices, **changes):
        tables = {"[map.drive.servo]\n": f"[line.leg]\n{table}\n[map.drive.servo]\n"}
        return rig_file(
            "real_time", replace={d: f'{d}line = "leg"\n' for d in devices} | tables, **changes
        )

    return write


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("kind", ["lost", "no answer"])
@pytest.mark.parametrize("at", range(125, 240, 7))
def test_a_lost_reply_leaves_its_drive_without_a_set_point_for_as_long_as_is_stated(
    tmp_path, line, kind, at
):
    run = run_with(tmp_path, Event(at, kind), line=line, trajectory=times(0.1))
    rig = RIGS["real_time", True, FINE_RAD, line]
    for joint, drive in enumerate(rig.drive):
        sent_at = [
            sent.time
            for sent in run.rig.told
            if sent.joint == joint and sent.control and sent.arrived
        ]
        waits = replies_waited_for(rig, drive, with_sensors=False)
        assert np.diff(sent_at).max() <= waits * rig.safety.longest_reply_s + 2 / RATE + SOON_S


@pytest.mark.parametrize(
    ("table", "devices", "with_sensors", "waits"),
    [
        (TCP, ("unit = 1\n", "unit = 2\n"), False, [2, 2]),
        (TCP, ("unit = 1\n",), False, [1, 1]),
        (RTU, ("unit = 1\n",), False, [2, 1]),
        (TCP, ("unit = 2\n", "unit = 12\n"), False, [1, 1]),
        (TCP, ("unit = 2\n", "unit = 12\n"), True, [1, 2]),
    ],
)
def test_a_drive_on_a_shared_line_or_with_replies_that_look_alike_is_silent_twice_as_long(
    with_line, table, devices, with_sensors, waits
):
    rig = load_rig(with_line(table, *devices))
    assert [
        replies_waited_for(rig, drive, with_sensors=with_sensors) for drive in rig.drive
    ] == waits


def test_a_drive_that_would_let_go_after_a_lost_reply_is_refused_before_anything_is_connected(
    with_line, excitation, tmp_path
):
    """With ``reply_s`` of 0.3 s, as 0.3 of the watchdog's second is."""
    path = with_line(TCP, "unit = 1\n", "unit = 2\n")
    run = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    with pytest.raises(SettingsError) as caught:
        acquire(path, run, excitation, tmp_path / "test.parquet")
    assert (
        str(caught.value)
        == f"{path}: plant.heartbeat_s: found 0.5, expected more than 0.61 s, for which one lost"
        " reply leaves drive hip (127.0.0.1:502, unit 1) without a set-point (2 x reply_s, and two"
        " samples); lower safety.reply_s, or raise the time-out in the drive"
    )


def test_what_the_rig_file_says_of_the_drives_own_watchdogs_counts_and_nothing_else_is_refused(
    with_line, rig_file
):
    both = "unit = 1\n", "unit = 2\n"
    shared = load_rig(with_line(TCP, *both))
    for heartbeat_s, is_refused in ((0.6, True), (0.61, True), (0.62, False)):
        safety = shared.safety.model_copy(update={"heartbeat_s": heartbeat_s})
        stated = shared.model_copy(update={"safety": safety})
        if is_refused:
            with pytest.raises(
                SettingsError,
                match=re.escape(f"safety.heartbeat_s: found {heartbeat_s:g}, expected"),
            ):
                refuse_short_heartbeat(stated, 200.0, with_sensors=False)
        else:
            refuse_short_heartbeat(stated, 200.0, with_sensors=False)
    refuse_short_heartbeat(shared.model_copy(update={"plant": None}), 200.0, with_sensors=False)
    refuse_short_heartbeat(load_rig(rig_file("real_time")), 200.0, with_sensors=True)  # a line each


@pytest.mark.parametrize(
    "path", sorted((datasets() / "rigs").glob("*.toml")), ids=lambda path: path.stem
)
def test_no_shipped_rig_lets_go_after_a_lost_reply(path):
    refuse_short_heartbeat(load_rig(path), 100.0, with_sensors=True)


def test_a_watchdog_that_would_bite_between_two_samples_is_refused_before_anything_is_connected(
    rig_file, excitation
):
    path = rig_file("real_time", free_port(), watchdog_s=0.01)
    run = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    with pytest.raises(SettingsError) as refused:
        acquire(path, run, excitation, path.with_name("test.parquet"), 200.0)
    assert (
        str(refused.value)
        == f"{path}: safety.watchdog_s: found 0.01, expected at least 0.015, 3 samples at 200 Hz,"
        " or it stops every run; raise it"
    )
    assert "watchdog_s: found 0.01" in str([*rate_findings(load_rig(path), 200.0)])
