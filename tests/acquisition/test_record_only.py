"""A machine that its own controller moves is recorded, and nothing is ever written to it."""

import json

import numpy as np
import pytest

from pipelines.acquisition.record_only import record_only
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.recording_only import load_recording_rig
from tests.acquisition.conftest import free_port

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
"""
CLOCK = """\
sequence = { address = 100, type = "uint32" }
time = { address = 102, type = "uint32", unit = "us" }
"""
REAL = {"[plant]\n": "[plant]\nsample_rate_hz = 40.0\n"}


@pytest.fixture
def record_only_on(rig_file, serve, tmp_path):
    """Record a served virtual rig, of which the recording's rig file knows only what it reads."""

    def run(clock="", fault=None, watchdog_s=10.0, rate_hz=40.0, **hooks):
        port = free_port()
        served = rig_file("real_time", port, REAL, rest_rad="[0.4, -0.6]", watchdog_s=10.0)
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
