"""Nobody's torque is taken by a second exoid, or by one that finds another program at the
drives."""

import os
import subprocess
import sys

import pytest

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.check.check import check_rig
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.errors import DeviceError
from pipelines.rig.device import Drive
from pipelines.rig.servo import Servo
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.line import RtuLine, TcpLine
from tests.acquisition.conftest import free_port

HOLD = """
import sys, time
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.settings.rig import load_rig
with exclusive_access(load_rig(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def control_words(monkeypatch):
    """Control words that drives were sent."""
    words, receive = [], Servo.receive

    def remember(servo, reference, control):
        words.append(control)
        receive(servo, reference, control)

    monkeypatch.setattr(Servo, "receive", remember)
    return words


def test_a_second_run_on_a_rig_is_refused_before_it_connects_and_names_the_first(
    rig_file, excitation, tmp_path
):
    path = rig_file(port=free_port())
    settings = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    with exclusive_access(load_rig(path)), pytest.raises(DeviceError) as caught:
        # There is no rig to connect to.
        acquire(path, settings, excitation, tmp_path / "test.parquet")
    assert str(caught.value).endswith(
        f"another exoid (process {os.getpid()}) uses the devices there; wait for its end; nothing"
        " was moved"
    )
    assert not list(tmp_path.glob("*.journal"))


@pytest.mark.parametrize("move", [False, True])
def test_a_check_during_a_run_is_refused_before_it_connects(rig_file, monkeypatch, move):
    path = rig_file(port=free_port())

    async def connect(*_):
        raise AssertionError("connected")

    monkeypatch.setattr("pipelines.acquisition.check.check._check", connect)
    with (
        exclusive_access(load_rig(path)),
        pytest.raises(DeviceError, match=rf"another exoid \(process {os.getpid()}\) uses"),
    ):
        check_rig(path, 200.0, move=move)


def test_who_is_killed_holds_no_line_any_more(rig_file):
    path = rig_file(port=free_port())
    holder = subprocess.Popen([sys.executable, "-c", HOLD, path], stdout=subprocess.PIPE, text=True)
    with holder:
        assert holder.stdout.readline() == "held\n"
        with (
            pytest.raises(DeviceError, match=rf"another exoid \(process {holder.pid}\)"),
            exclusive_access(load_rig(path)),
        ):
            raise AssertionError("the line is held")
        holder.kill()
        holder.wait()
    with exclusive_access(load_rig(path)):
        pass


@pytest.mark.parametrize("kind", ["host", "port"])
def test_a_line_is_the_same_however_it_is_written(rig_file, tmp_path, kind):
    rig, number = load_rig(rig_file()), free_port()
    (tmp_path / "by-id").symlink_to(tmp_path / "tty")
    first, second = {
        "host": (TcpLine(host="127.0.0.1", port=number), TcpLine(host="localhost", port=number)),
        "port": [
            RtuLine(transport="rtu", serial_port=str(tmp_path / name)) for name in ("tty", "by-id")
        ],
    }[kind]

    def on(line):
        drives = [drive.model_copy(update={"line": "one"}) for drive in rig.drive]
        return rig.model_copy(update={"drive": tuple(drives), "sensor": (), "line": {"one": line}})

    with (
        exclusive_access(on(first)),
        pytest.raises(DeviceError, match="another exoid"),
        exclusive_access(on(second)),
    ):
        raise AssertionError("the line is held")


@pytest.fixture
def left_enabled(monkeypatch):
    begin = Servo.__init__

    def enabled(servo, *arguments):
        begin(servo, *arguments)
        servo._control = servo._map.enable

    monkeypatch.setattr(Servo, "__init__", enabled)


@pytest.mark.parametrize("drops", [(), ("enabled_",)])
def test_a_drive_to_which_another_program_sends_set_points_is_sent_nothing(
    record, control_words, left_enabled, drops
):
    def goes_on(device, function, written):
        if isinstance(device, Drive) and device.registers:
            device.registers[device.write.address - device.first + 1] += 1

    served = []
    with pytest.raises(
        DeviceError,
        match=r"^drive hip .* and drive knee .*: driven by another program, as angle or",
    ):
        record(fault=goes_on, served_as=served, drop=drops)
    assert not control_words
    assert served[0].enabled == [True, True]
