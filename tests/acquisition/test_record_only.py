"""A machine that its own controller moves is recorded, and nothing is ever written to it."""

import asyncio
import contextlib
import itertools
import json
import re
import socket
import struct
import threading
import time

import numpy as np
import pytest

from pipelines.acquisition.check import survey
from pipelines.acquisition.check.absent import explain_absence
from pipelines.acquisition.check.check import check_rig
from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.machine.read_only import ReadOnlyMachine
from pipelines.acquisition.record_only import record_only
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.recording_only import load_recording_rig
from tests.acquisition.bench import BENCH, ELBOW, TURNING
from tests.acquisition.conftest import free_port

pytestmark = pytest.mark.long

RIG = """\
name = "bench"
recording_only = true
[[drive]]
joint = "hip"
port = {port}
unit = 1
map = "plc"
torque_constant_nm_a = 0.12
gear_ratio = 100.0
[[drive]]
joint = "knee"
port = {port}
unit = 2
map = "plc"
torque_constant_nm_a = 0.12
gear_ratio = 80.0
[map.drive.plc.read]
{clock}
angle = {{ address = 104, type = "int32", scale = 1e-6, unit = "rad" }}
current = {{ address = 108, type = "int32", scale = 0.1, unit = "mA" }}
[safety]
watchdog_s = {watchdog_s}
connect_s = 0.5
"""
CLOCK = """\
sequence = { address = 100, type = "uint32" }
time = { address = 102, type = "uint32", unit = "us" }
"""
ANSWER_S = 0.001
"""How long a served device takes to answer, as real ones do; else it keeps a processor busy."""
REAL = {"[plant]\n": "[plant]\nsample_rate_hz = 40.0\n"}


@pytest.fixture(autouse=True)
def short_check(monkeypatch):
    """These machines move fast enough to be judged within half the time."""
    monkeypatch.setattr(survey, "ALONE_S", 1.0)


@pytest.fixture
def record_only_on(rig_file, serve, tmp_path):
    """Record a served virtual rig, of which the recording's rig file knows only what it reads."""

    def run(clock="", fault=None, watchdog_s=10.0, rate_hz=40.0, **hooks):
        port = free_port()
        # Friction holds the leg at rest, however long the first row takes to come.
        rest = {"rest_rad": "[0.4, -0.6]", "coulomb_nm": "[60.0, 60.0]"}
        served = rig_file("real_time", port, REAL, watchdog_s=10.0, **rest)
        path, output = tmp_path / "only.toml", tmp_path / "only.parquet"
        path.write_text(RIG.format(port=port, clock=clock, watchdog_s=watchdog_s))
        settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=1.0)
        with serve(served, port, fault=fault):
            outcome = record_only(path, settings, output, rate_hz, MechanismSettings(), **hooks)
        return outcome, RECORDING.read(output)

    return run


@pytest.mark.parametrize("clock", ["", CLOCK], ids=["by the host's clock", "by the device's"])
def test_a_recording_has_a_row_for_each_sample_and_nothing_is_written(record_only_on, clock):
    functions = set()

    def note(device, function, written):
        functions.add((function, written is not None))

    outcome, table = record_only_on(clock, note)
    assert functions == {(3, False)}
    assert outcome.samples + outcome.missed == 40
    assert outcome.samples >= 30, "even on a busy computer"
    frame, metadata = table.frame, table.metadata
    assert metadata["recording_only"] is True
    assert np.allclose(frame["hip_angle_rad"].iloc[0], 0.4, atol=0.05)
    torque = 0.12 * 80.0 * frame["knee_current_a"]
    assert np.allclose(frame["knee_torque_nm"], torque)
    # Rows are where their numbers say, within half a sample.
    late = frame["time_s"] - frame["sequence"] / 40.0
    assert (abs(late - late.iloc[0]) <= 0.5 / 40.0 + 1e-6).all()
    reading = metadata["reading"]
    assert reading["clock"] == ("device" if clock else "host")
    assert 0.0 < reading["uncertainty_median_s"] <= reading["uncertainty_longest_s"] < 1.0


def test_a_machine_that_falls_silent_leaves_an_aborted_recording(record_only_on, tmp_path):
    asked = iter(range(10**9))

    def silent_later(device, function, written):
        if next(asked) > 30:
            raise AssertionError("the device does nothing any more")

    with pytest.raises(DeviceError, match="samples so far are in") as caught:
        record_only_on(fault=silent_later, watchdog_s=0.6)
    assert caught.value.exit_code == 3
    assert not (tmp_path / "only.parquet").exists()
    assert not list(tmp_path.glob("*.journal"))
    aborted = RECORDING.read(tmp_path / "only.aborted.parquet")
    assert aborted.metadata["abort"]
    assert len(aborted.frame) > 5


def a_device(answer, most_answers=10**9, answers_as=lambda unit: unit):
    """Serve counter (100 a second), angle and torque; `answer(n, words)` may give other words.

    It gives an exception code instead, or None for no answer. A connection ends after
    `most_answers`. `answers_as(unit)` gives the unit that a reply names, or 0 for exception 11,
    "gateway got no answer", or None for no answer. Returns the server's socket, and the set of
    functions that were asked for.
    """
    asked, began = set(), time.monotonic()
    numbers = itertools.count()

    def serve(link):
        # A frame of another kind has too few bytes.
        with link, contextlib.suppress(OSError, struct.error, IndexError):
            for _ in range(most_answers):
                head = link.recv(7, socket.MSG_WAITALL)
                if len(head) < 7:
                    return
                content = link.recv(int.from_bytes(head[4:6], "big") - 1, socket.MSG_WAITALL)
                time.sleep(ANSWER_S)
                asked.add(content[0])
                first, count = struct.unpack(">HH", content[1:5])
                now = round(100.0 * (time.monotonic() - began))
                unit = answers_as(head[6])
                words = 11 if unit == 0 else answer(next(numbers), [now, 500, 20])
                if words is None or unit is None:
                    continue
                reply = (
                    bytes([content[0] | 0x80, words])
                    if isinstance(words, int)
                    else struct.pack(
                        f">BB{count}H", content[0], 2 * count, *words[first : first + count]
                    )
                )
                named = struct.pack(">HB", len(reply) + 1, unit or head[6])
                link.sendall(head[:4] + named + reply)

    def accept():
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=serve, args=(server.accept()[0],), daemon=True).start()

    server = socket.create_server(("127.0.0.1", 0))
    threading.Thread(target=accept, daemon=True).start()
    return server, asked


@pytest.fixture
def record_bench(tmp_path):
    """Record a device for 0.8 s; return the rows. Nothing may be written to it."""

    def run(answer, most_answers=10**9, rate_hz=100.0, watchdog_s=0.6, mechanism=ELBOW):
        server, asked = a_device(answer, most_answers)
        path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
        path.write_text(BENCH.format(port=server.getsockname()[1], watchdog_s=watchdog_s))
        settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=0.8)
        with server:
            record_only(path, settings, output, rate_hz, mechanism)
        assert asked == {3}
        return RECORDING.read(output).frame

    return run


def busy_now_and_then(n, words):
    return 6 if n % 7 == 6 else words


def leaps_now_and_then(n, words):
    return [words[0] + 3000, 900, 20] if n % 7 == 6 else words


def slow(n, words):
    time.sleep(0.025)
    return words


@pytest.mark.parametrize(
    ("answer", "most_answers"),
    [(busy_now_and_then, 10**9), (leaps_now_and_then, 10**9), (slow, 10**9), (slow, 5)],
    ids=["busy", "another device's answer", "slower than its samples", "five answers a connection"],
)
def test_a_fault_of_one_answer_costs_one_row_and_never_a_wrong_one(
    record_bench, answer, most_answers
):
    frame = record_bench(answer, most_answers)
    assert len(frame) >= 12, "even where an answer takes 25 ms"
    assert (frame["elbow_angle_rad"] == 0.5).all()
    assert frame["sequence"].iloc[-1] <= 80
    assert np.allclose(frame["time_s"], frame["sequence"] / 100.0, atol=0.1)


def test_a_recording_that_ends_early_names_the_fault_that_ended_it(record_bench):
    expected = (
        r"^watchdog: no whole row for 0\.\d+ s, allowed are 0\.3 s \(safety\.watchdog_s\):"
        r" drive elbow \(127\.0\.0\.1:\d+, unit 1\): .*it is busy"
    )
    with pytest.raises(DeviceError, match=expected):
        record_bench(lambda n, words: 6 if n > 30 else words, watchdog_s=0.3)


def test_a_counter_that_stands_still_ends_a_recording_and_names_its_device(record_bench):
    expected = (
        r"^watchdog: no new sample from drive elbow \(127\.0\.0\.1:\d+, unit 1\) for 0\.\d+ s,"
        r" allowed are 0\.3 s \(safety\.watchdog_s\): its counter stands still; check that the"
        " machine runs"
    )
    with pytest.raises(DeviceError, match=expected):
        record_bench(lambda n, words: [7, 500, 20], watchdog_s=0.3)


def test_a_counter_of_another_rate_is_refused_rather_than_recorded(record_bench):
    with pytest.raises(DeviceError, match=r"expected 25 a second; correct acquire\.sample_rate_hz"):
        record_bench(lambda n, words: words, rate_hz=25.0)


def test_the_check_counts_answers_that_fail_and_changes_no_unit_for_them(tmp_path):
    server, asked = a_device(busy_now_and_then, 5)
    path = tmp_path / "bench.toml"
    path.write_text(BENCH.format(port=server.getsockname()[1], watchdog_s=1.0))
    with server:
        report = check_rig(path, 100.0)
    assert asked == {3}
    assert not report.findings
    notes = "\n".join(report.notes)
    assert "readings failed; the first answered" in notes
    assert "and was opened again" in notes


@pytest.mark.parametrize(
    ("was", "now", "message"),
    [
        ("gear_ratio = 80.0\n", "", "drive[1]: torque_constant_nm_a and gear_ratio are missing"),
        ('joint = "knee"', 'joint = "hip"', "drive: found hip, hip, expected each joint once"),
        ("current = ", "temperature = ", "found 'mA', expected °C"),
        ("[safety]", "[map.drive.plc.write]\n[safety]", "map.drive.plc.write: unknown key"),
    ],
)
def test_a_recording_only_file_that_cannot_be_used_is_refused(tmp_path, was, now, message):
    text = RIG.format(port=1, clock="", watchdog_s=1.0)
    assert was in text
    path = tmp_path / "only.toml"
    path.write_text(text.replace(was, now))
    with pytest.raises(SettingsError) as caught:
        load_recording_rig(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_joints_of_another_mechanism_are_refused_before_anything_is_connected(tmp_path):
    path = tmp_path / "only.toml"
    text = RIG.format(port=free_port(), clock="", watchdog_s=1.0)
    path.write_text(text.replace('joint = "knee"', 'joint = "elbow"'))
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=1.0)
    with pytest.raises(SettingsError, match=r"found joints hip, elbow, expected .* hip, knee"):
        record_only(path, settings, tmp_path / "a.parquet", 40.0, MechanismSettings())


def test_no_command_that_moves_takes_a_recording_only_file(tmp_path, exoid):
    path = tmp_path / "only.toml"
    path.write_text(RIG.format(port=free_port(), clock="", watchdog_s=1.0))
    with pytest.raises(SettingsError, match="is recording_only, and this command moves"):
        load_rig(path)
    moved = exoid("rig", "check", path, "--move", "--yes")
    assert moved.code == 2
    assert "recording_only" in moved.err
    experiment = tmp_path / "exoid.toml"
    experiment.write_text(
        f'[acquire]\nrig = {json.dumps(str(path))}\nsample_rate_hz = 40.0\n[[run]]\nname = "one"\n'
        'run = "exo_alone"\npurpose = "train"\nduration_s = 1.0\n'
    )
    off = exoid("acquire", "--config", experiment, "--run", "one")
    assert off.code == 3
    assert "exoid moves nothing, and writes nothing to any device" in off.out
    assert "refuses the connection" in off.err
    assert exoid("acquire", "--config", experiment, "--run", "one", "--reset-faults").code == 2


def test_a_device_behind_a_lost_connection_is_not_taken_for_another_unit(tmp_path):
    server, _ = a_device(lambda n, words: words)  # answers as any unit
    path = tmp_path / "bench.toml"
    path.write_text(BENCH.format(port=server.getsockname()[1], watchdog_s=1.0))

    async def run():
        part = ReadOnlyMachine(load_recording_rig(path)).parts[0]
        probe = Probe(part, False)
        await probe.read()
        part.device.line.close()
        finding = await explain_absence(probe, [probe])
        part.device.line.close()
        return finding

    with server:
        assert asyncio.run(run()) is None


def test_a_line_that_the_other_end_closes_is_one_finding_for_all_its_joints(tmp_path):
    server, _ = a_device(lambda n, words: words, most_answers=0)
    port = server.getsockname()[1]
    line = f'[line.leg]\ntransport = "tcp"\nport = {port}\n'
    text = RIG.format(port=port, clock="", watchdog_s=1.0)
    path = tmp_path / "bench.toml"
    path.write_text(text.replace(f"port = {port}\n", 'line = "leg"\n') + line)
    with server:
        findings = check_rig(path, 100.0).findings
    assert [one.device for one in findings] == ["rig"]
    assert "the other end closed the line without an answer" in findings[0].text
    assert "drive hip (unit 1), drive knee (unit 2)" in findings[0].text


JOINT = '[[drive]]\njoint = "{}"\nport = {{port}}\nunit = {}\nmap = "plc"\n'
ONLY_UNIT = (
    "does not answer as unit {}, only unit 1 does, which is drive hip's; check its cable, its power"
    " and the gateway's units. If one controller serves both, set unit = 1 and a map of its own"
)
OTHER_UNIT = (
    "asked as unit {}, an answer came from unit 1, which is drive hip's; let the gateway pass on"
    " all units. If one controller serves both, set unit = 1 and a map of its own"
)


@pytest.mark.parametrize(
    ("answers_as", "expected"),
    [
        (lambda unit: 1 if unit == 1 else None, ONLY_UNIT),
        (lambda unit: 1 if unit == 1 else 0, ONLY_UNIT),
        (lambda unit: 1, OTHER_UNIT),
    ],
    ids=["silent for others", "with exceptions for others", "in the name of unit 1"],
)
@pytest.mark.parametrize("units", [(1, 2), pytest.param((2, 3), marks=pytest.mark.slow)], ids=str)
def test_a_gateway_that_answers_as_unit_1_alone_is_never_advised_for_two_devices(
    tmp_path, answers_as, expected, units
):
    server, _ = a_device(lambda n, words: words, answers_as=answers_as)
    path = tmp_path / "bench.toml"
    joints = JOINT.format("hip", units[0]) + JOINT.format("knee", units[1])
    text = re.sub(r"\[\[drive\]\].*?map = \"plc\"\n", joints, BENCH, count=1, flags=re.DOTALL)
    path.write_text(text.format(port=server.getsockname()[1], watchdog_s=1.0))
    with server:
        report = check_rig(path, 100.0)
    of_knee = [one.text for one in report.findings if one.device == "drive knee"]
    assert of_knee == [expected.format(units[1])]
    of_hip = [one.text for one in report.findings if one.device == "drive hip"]
    assert len(of_hip) == (units[0] != 1)
    assert all("correct unit" in text for text in of_hip)


def test_a_multi_turn_register_is_recorded_beyond_one_turn(record_bench):
    def answer(n, words):
        return [words[0], 12000 + words[0] * 50, 20]

    with pytest.raises(DeviceError, match="joint without end needs turns = true"):
        record_bench(answer)
    angle = record_bench(answer, mechanism=TURNING)["elbow_angle_rad"]
    assert angle.iloc[0] >= 12.0 and angle.iloc[-1] > angle.iloc[0] + 2.0
