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
import tomllib

import numpy as np
import pytest

from pipelines.acquisition.check import survey
from pipelines.acquisition.check.absent import explain_absence
from pipelines.acquisition.check.check import check_rig
from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.machine.read_only import ReadOnlyMachine
from pipelines.acquisition.record_only import misread_values, record_only
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError
from pipelines.modbus.register_block import Block
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import Register, load_rig
from pipelines.settings.rig.recording_only import load_recording_rig
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


RECORDING_ONLY = """\
name = "bench"
recording_only = true
[[drive]]
joint = "elbow"
port = {port}
map = "plc"
[map.drive.plc.read]
{registers}
[safety]
watchdog_s = {watchdog_s}
connect_s = 0.5
"""
BENCH = RECORDING_ONLY.replace(
    "{registers}",
    """\
sequence = {{ address = 0, type = "uint16" }}
angle = {{ address = 1, type = "int16", scale = 1e-3, unit = "rad" }}
torque = {{ address = 2, type = "int16", scale = 0.1, unit = "N·m" }}""",
)
ELBOW = MechanismSettings.model_validate({"joints": [{"name": "elbow", "kind": "revolute"}]})


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


SWING = RECORDING_ONLY.replace(
    "{registers}",
    '{counter}{angle}{velocity}torque = {{ address = {torque}, type = "int16", unit = "N·m" }}',
).replace("{watchdog_s}", "0.6")
LONG = 'address = {}, type = "int32", word_order = "{}", scale = {}'


def swings(torn=False):
    """Serve counter, angle and velocity in thousandths of a degree, low words first."""
    began = time.monotonic()

    def at(k):
        angle = 66.0 + 20.0 * np.sin(6.0 * k / 100.0)
        return round(1e3 * angle), round(1e3 * 120.0 * np.cos(6.0 * k / 100.0))

    def answer(n, words):
        k = round(100.0 * (time.monotonic() - began))
        (angle, velocity), (before, _) = at(k), at(k - 1)
        high = (before if torn else angle) >> 16
        long = [angle & 0xFFFF, high & 0xFFFF, velocity & 0xFFFF, velocity >> 16 & 0xFFFF]
        return [k & 0xFFFF, *long, 20, 0, 0]

    return a_device(answer)


@pytest.fixture
def swinging(tmp_path):
    """Return a rig file of a device that swings, and its server."""

    def write(torn=False, by=0, order="little", scale=1e-3, counter=True, has_velocity=True):
        server, _ = swings(torn)
        path = tmp_path / "swing.toml"
        text = SWING.format(
            port=server.getsockname()[1],
            counter='sequence = { address = 0, type = "uint16" }\n' if counter else "",
            angle=f'angle = {{ {LONG.format(1 + by, order, scale)}, unit = "deg" }}\n',
            velocity=f'velocity = {{ {LONG.format(3 + by, order, 1e-3)}, unit = "deg/s" }}\n'
            if has_velocity
            else "",
            torque=5 + by,
        )
        path.write_text(text)
        return path, server

    return write


def findings_of(path, server):
    with server:
        return [finding.text for finding in check_rig(path, 100.0).findings]


def test_a_right_map_of_a_machine_that_moves_has_no_findings(swinging):
    assert findings_of(*swinging()) == []


def test_words_in_the_wrong_order_are_named_though_no_limits_are_known(swinging):
    for counter in (True, False):
        (text,) = findings_of(*swinging(order="big", has_velocity=False, counter=counter))
        assert 'with word_order = "little" by' in text
        assert "correct map.drive.plc.read.angle, or its address" in text


def test_a_map_without_a_counter_that_is_one_address_off_is_named_by_its_velocity(swinging):
    (text,) = findings_of(*swinging(by=1, counter=False))
    assert "all of map.drive.plc.read is one address too high: subtract 1 from each" in text
    assert "write may be" not in text


def test_an_angle_of_another_scale_is_found_by_its_velocity(swinging):
    (text,) = findings_of(*swinging(scale=1e-4))
    assert text.endswith(
        "correct the scale of map.drive.plc.read.angle or map.drive.plc.read.velocity, by a factor"
        " of 10"
    )


def test_words_of_two_samples_are_named_and_never_recorded(swinging, tmp_path):
    (text,) = findings_of(*swinging(torn=True))
    assert "angle leaps by 65536 counts and back" in text
    path, server = swinging(torn=True)
    output = tmp_path / "swing.parquet"
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=2.0)
    with server:
        record_only(path, settings, output, 100.0, ELBOW)
    table = RECORDING.read(output)
    angle = np.degrees(table.frame["elbow_angle_rad"])
    assert 45.9 < angle.min() < angle.max() < 86.1
    assert table.metadata["reading"]["torn_rows"] > 0


def test_an_angle_that_no_recording_holds_ends_the_run_with_its_value(swinging, tmp_path):
    path, server = swinging(order="big")
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=1.0)
    with server, pytest.raises(DeviceError, match=r"its angle is \S+ rad, and a recording holds"):
        record_only(path, settings, tmp_path / "swing.parquet", 100.0, ELBOW)


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


def a_turntable():
    """Serve a counter, and an angle in tenths of a degree that turns by 14 rad/s, from 0 again."""

    def answer(n, words):
        return [words[0], words[0] * 80 % 3600, 20]

    return a_device(answer)


TURNING = MechanismSettings.model_validate(
    {"joints": [{"name": "elbow", "kind": "revolute", "turns": True}]}
)


@pytest.fixture
def turntable(tmp_path):
    def write(wraps_at=""):
        server, _ = a_turntable()
        path = tmp_path / "turntable.toml"
        text = BENCH.format(port=server.getsockname()[1], watchdog_s=1.0)
        wrong = 'scale = 1e-3, unit = "rad"'
        assert wrong in text
        path.write_text(text.replace(wrong, f'scale = 0.1, unit = "deg"{wraps_at}'))
        return path, server

    return write


def test_the_turns_of_a_joint_without_end_are_counted(turntable, tmp_path):
    path, server = turntable(", wraps_at = 3600")
    output = tmp_path / "turntable.parquet"
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=2.5)
    with server:
        with pytest.raises(SettingsError, match=r"set turns = true at that joint"):
            record_only(path, settings, output, 100.0, ELBOW)
        record_only(path, settings, output, 100.0, TURNING)
    frame = RECORDING.read(output).frame
    turned = np.radians(8.0) * (frame["sequence"] - frame["sequence"].iloc[0])
    assert turned.iloc[-1] > 4.0 * np.pi, "more than a recording of another joint holds"
    angle = frame["elbow_angle_rad"]
    assert np.allclose(angle - angle.iloc[0], turned, atol=1e-6)


def test_a_multi_turn_register_is_recorded_beyond_one_turn(record_bench):
    def answer(n, words):
        return [words[0], 12000 + words[0] * 50, 20]

    with pytest.raises(DeviceError, match="joint without end needs turns = true"):
        record_bench(answer)
    angle = record_bench(answer, mechanism=TURNING)["elbow_angle_rad"]
    assert angle.iloc[0] >= 12.0 and angle.iloc[-1] > angle.iloc[0] + 2.0


def test_an_angle_that_starts_again_is_never_recorded_as_a_leap(turntable, tmp_path):
    path, server = turntable()
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=3.0)
    with server, pytest.raises(DeviceError, match=r"elbow_angle_rad leaps .*wraps_at"):
        record_only(path, settings, tmp_path / "turntable.parquet", 100.0, ELBOW)
    assert not (tmp_path / "turntable.parquet").exists()


def test_the_check_names_the_count_at_which_an_angle_starts_again(turntable):
    (text,) = findings_of(*turntable())
    assert "angle leaps by 3600 counts" in text
    assert "set map.drive.plc.read.angle.wraps_at = 3600, and turns = true" in text
    assert findings_of(*turntable(", wraps_at = 3600")) == []


@pytest.mark.parametrize(
    ("kind", "negative", "expected"),
    [
        ("uint16", lambda m: 65536 - m, 'set map.drive.plc.read.torque.type = "int16"'),
        ("uint16", lambda m: 32768 + m, "a magnitude with a sign bit"),
        ("int16", lambda m: 32768 + m, "a magnitude with a sign bit"),
        ("int16", lambda m: 65536 - m, ""),
    ],
)
def test_a_sign_that_is_misread_is_named(tmp_path, kind, negative, expected):
    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, torque if torque >= 0 else negative(-torque)]

    server, _ = a_device(answer)
    path = tmp_path / "bench.toml"
    text = BENCH.format(port=server.getsockname()[1], watchdog_s=1.0)
    was = 'torque = { address = 2, type = "int16"'
    assert was in text
    path.write_text(text.replace(was, was.replace("int16", kind)))
    texts = findings_of(path, server)
    assert len(texts) == bool(expected)
    assert all(expected in one and "torque: leaps by" in one for one in texts)


@pytest.fixture
def record_and_check(tmp_path):
    """Record and check a device; return the recording, and what both say of its values."""

    def run(answer, was="", now="", seconds=1.0, kind="exo_alone"):
        server, _ = a_device(answer)
        path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
        text = BENCH.format(port=server.getsockname()[1], watchdog_s=1.0)
        assert was in text
        path.write_text(text.replace(was, now) if was else text)
        output.unlink(missing_ok=True)
        settings = RunSettings(name="one", run=kind, purpose="train", duration_s=seconds)
        with server:
            record_only(path, settings, output, 100.0, ELBOW)
            return output, misread_values(output, path), findings_of(path, server)

    return run


@pytest.mark.parametrize(
    ("keys", "middle", "expected"),
    [
        ('type = "uint16"', 0, 'read as large ones; set {}.type = "int16"'),
        ('type = "int16"', 32768, '{}.type = "uint16" and offset = -32768'),
        ('type = "uint16"', 32768, "if it stands for 0, set {}.offset = -32768"),
        ('type = "int16"', 0, ""),
        ('type = "uint16", offset = -32768', 32768, ""),
    ],
)
def test_a_torque_that_counts_from_another_zero_is_named(record_and_check, keys, middle, expected):
    """By the check and in the recording, which may be the first to see it change its sign."""

    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, (torque + middle) & 0xFFFF]

    was = 'address = 2, type = "int16", scale = 0.1'
    _, warnings, findings = record_and_check(answer, was, f"address = 2, {keys}")
    texts = warnings + findings
    assert len(texts) == 2 * bool(expected)
    assert all(expected.format("map.drive.plc.read.torque") in text for text in texts)


def test_a_torque_of_magnitude_and_sign_bit_is_recorded_and_has_no_findings(tmp_path):
    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, torque if torque >= 0 else 32768 - torque]

    path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
    for act in ("check", "record"):
        server, _ = a_device(answer)
        text = BENCH.format(port=server.getsockname()[1], watchdog_s=1.0)
        was = 'torque = { address = 2, type = "int16"'
        path.write_text(text.replace(was, f"{was.replace('int16', 'uint16')}, sign_bit = 15"))
        if act == "check":
            assert findings_of(path, server) == []
            continue
        settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=0.8)
        with server:
            record_only(path, settings, output, 100.0, ELBOW)
    torque = RECORDING.read(output).frame["elbow_torque_nm"]
    assert -20.0 <= torque.min() < -15.0 and 15.0 < torque.max() <= 20.0


@pytest.mark.parametrize("every", [1, 5], ids=["each sample", "each fifth sample"])
def test_registers_that_are_renewed_slower_than_rows_come_are_named(record_and_check, every):
    def answer(n, words):
        at = words[0] // every * every / 100.0
        return [words[0], round(800.0 * np.sin(6.0 * at)) & 0xFFFF, 20]

    output, texts, findings = record_and_check(answer, seconds=1.2)
    assert len(texts) == len(findings) == (every > 1), "the torque rests"
    for text, start in zip(
        (*texts, *findings), (f"{output}: elbow_angle_rad", "angle"), strict=False
    ):
        rate = re.match(re.escape(start) + r": new values come at ([\d.]+) Hz, and rows at", text)
        assert rate is not None and 18.0 < float(rate[1]) < 22.0


@pytest.mark.parametrize("largest", [20000.0, 50000.0], ids=["within", "beyond"])
def test_a_torque_that_is_cut_off_at_the_end_of_its_register_is_named(record_and_check, largest):
    def answer(n, words):
        torque = round(largest * np.sin(0.1 * words[0]))
        return [words[0], 500, min(max(torque, -32768), 32767) & 0xFFFF]

    _, texts, findings = record_and_check(answer)
    assert len(texts) == len(findings) == (largest > 32768.0)
    for text, name in zip((*texts, *findings), ("elbow_torque_nm", "torque"), strict=False):
        assert re.search(rf"{name}: \d+ of \d+ values are at the end of their register", text)


@pytest.mark.parametrize("most", [27648, 16000], ids=["beyond", "within"])
def test_a_torque_that_is_cut_off_within_its_register_is_named(record_and_check, most):
    """An analog input ends at 27648 counts, far from the end of its 16 bits."""

    def answer(n, words):
        torque = round(1.5 * most * np.sin(0.1 * words[0]))
        return [words[0], 500, min(max(torque, -27648), 27648) & 0xFFFF]

    _, texts, findings = record_and_check(answer, seconds=2.0)
    assert len(texts) == len(findings) == (most == 27648)
    assert all("at full slope and stay there" in text for text in (*texts, *findings))


@pytest.mark.parametrize("run", ["exo_alone", "with_human"])
@pytest.mark.parametrize("scale", [0.1, -0.1])
def test_a_torque_of_the_wrong_sign_is_named_where_nobody_is_in_the_machine(tmp_path, run, scale):
    """Friction consumes what a drive delivers; a person may drive the machine."""

    def answer(n, words):
        phase = 0.1 * words[0]
        torque = round(200.0 * np.cos(phase) - 300.0 * np.sin(phase))
        return [words[0], round(700.0 * np.sin(phase)) & 0xFFFF, torque & 0xFFFF]

    server, _ = a_device(answer)
    path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
    text = BENCH.format(port=server.getsockname()[1], watchdog_s=1.0)
    path.write_text(text.replace("scale = 0.1", f"scale = {scale}"))
    settings = RunSettings(name="one", run=run, purpose="train", duration_s=2.0)
    with server:
        record_only(path, settings, output, 100.0, ELBOW)
    texts = misread_values(output, path)
    assert len(texts) == (run == "exo_alone" and scale < 0.0)
    assert all("the drives absorb" in text for text in texts)


ENCODED = {
    "mod10": ('type = "uint32", encoding = "mod10"', 'type = "uint32"'),
    "mod10, a sign each word": ('type = "int32", encoding = "mod10"', 'type = "int32"'),
    "bcd": ('type = "uint32", encoding = "bcd", sign_bit = 31', 'type = "int32"'),
    "direction": ('type = "uint32", direction = { address = 4, negative = 1 }', 'type = "uint32"'),
}
"""Keys of a torque as a device encodes it, and as a hurried user writes them."""
NAMED = {
    "mod10": 'encoding = "mod10"',
    "mod10, a sign each word": 'encoding = "mod10"',
    "bcd": 'encoding = "bcd" and type = "uint32" and sign_bit = 31',
    "direction": "direction to the register that has it, or sign_bit",
}
"""What the check says then."""


@pytest.mark.parametrize("encoded", ENCODED)
def test_an_encoding_is_recorded_as_the_file_says_and_named_where_it_does_not(
    record_and_check, encoded
):
    right, wrong = (f'address = 2, {keys}, unit = "N·m"' for keys in ENCODED[encoded])
    device = Block({"torque": Register.model_validate(tomllib.loads(f"x = {{ {right} }}")["x"])})
    middle = 25000.0 if encoded == "mod10" else 0.0

    def answer(n, words):
        torque = middle + 24000.0 * np.sin(0.15 * words[0])
        return [words[0], 500, *device.encode({"torque": torque}), 0, 0][:5]

    was = 'address = 2, type = "int16", scale = 0.1, unit = "N·m"'
    for keys in (right, wrong):
        output, warnings, findings = record_and_check(answer, was, keys, seconds=1.2)
        texts = warnings + findings
        if keys == wrong:
            assert len(texts) == 2
            assert all(f"set map.drive.plc.read.torque.{NAMED[encoded]}" in text for text in texts)
            continue
        assert texts == []
        frame = RECORDING.read(output).frame
        # The rows' numbers begin with that of the device at the first row.
        phases = 0.15 * (frame["sequence"].to_numpy() + np.arange(10**4)[:, None])
        wrong_nm = middle + 24000.0 * np.sin(phases) - frame["elbow_torque_nm"].to_numpy()
        assert np.abs(wrong_nm).max(axis=1).min() <= 1.0
