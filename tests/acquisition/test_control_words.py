"""What a drive is told beside set-points, and how it is made sure that it took it."""

import asyncio

import pytest

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.modbus.device import Device
from pipelines.errors import DeviceError, Refused, SettingsError
from pipelines.rig.device import Drive
from pipelines.rig.servo import Servo
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.conftest import free_port

ENABLE, DISABLE, HALT, RESET = 0x000F, 0x0000, 0x010F, 0x0080


@pytest.fixture
def heard(monkeypatch):
    """Control words that drives heard, each once in a row, by drive."""
    words, hear = {}, Servo.receive

    def remember(servo, reference, control):
        mine = words.setdefault(id(servo), [])
        if mine[-1:] != [control]:
            mine.append(control)
        hear(servo, reference, control)

    monkeypatch.setattr(Servo, "receive", remember)
    return lambda: list(words.values())


def test_a_run_enables_halts_and_disables_and_nothing_else(record, heard):
    record()
    assert heard() == [[DISABLE, ENABLE, HALT, DISABLE]] * 2


def test_the_shipped_template_records_a_run_where_a_virtual_rig_plays_it(tmp_path, excitation):
    rigs, path, output = datasets() / "rigs", tmp_path / "lab.toml", tmp_path / "test.parquet"
    template, plant = (
        (rigs / "lab.toml").read_text(),
        (rigs / "plain.toml").read_text().partition("[plant]\n")[2],
    )
    embedded = template.replace(
        'name = "lab"\n', 'name = "lab"\nembedded = true\nclock = "lockstep"\n'
    )
    assert "watchdog_s = 0.1 " in embedded
    patient = embedded.replace("watchdog_s = 0.1 ", "watchdog_s = 20.0 ")
    path.write_text(f"{patient}\n[plant]\n{plant}")
    excitation.write_text(
        'unit = "rad"\nomega_rad_s = 6.283185307179586\ntheta0_rad = [0.2, -0.4]\n'
        "a = [[0.02], [0.02]]\nb = [[0.0], [0.0]]\n"
    )
    settings = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    assert acquire(path, settings, excitation, output, 100.0).samples == 100


def test_a_drive_that_knows_no_halt_is_held_by_its_set_point(record, heard):
    record(drop=("halt = ",))
    assert heard() == [[DISABLE, ENABLE, DISABLE]] * 2


def test_a_drive_that_does_not_say_that_it_is_enabled_is_not_moved(record, monkeypatch):
    moved, served, hear = [], [], Servo.receive

    def remember(servo, reference, control):
        moved.append(reference)
        hear(servo, reference, control)

    monkeypatch.setattr(Servo, "status", 0)
    monkeypatch.setattr(Servo, "receive", remember)
    with pytest.raises(DeviceError) as caught:
        record(served_as=served, control_s=0.5)
    assert str(caught.value).startswith(
        "drive hip: not enabled 0.5 s after the command, by its status word; see the drive's manual"
    )
    assert set(moved) == {0.0}
    assert served[0].enabled == [False, False]


def test_a_drive_that_says_it_is_no_longer_enabled_ends_the_run(record):
    def press(device, function, written):
        if isinstance(device, Drive) and device.rig.sample.sequence[0] > 300:
            device.servo.receive(0.0, DISABLE)
            device.servo.receive = lambda reference, control: None

    with pytest.raises(DeviceError, match="is no longer enabled; was the emergency stop pressed"):
        record(fault=press)


def test_a_drive_that_still_says_enabled_is_told_again_and_then_reported(record, monkeypatch):
    told, write = [], Device.write

    async def count(device, block, words, **how):
        told.append(device.label.split()[1])
        await write(device, block, words, **how)

    monkeypatch.setattr(Device, "write", count)
    status, enabled = Servo.status.fget, set()

    def sticks(servo):
        enabled.update({servo} if servo.enabled and servo._limits[0] > -1.0 else ())  # the hip's
        return status(servo) | (servo in enabled)

    monkeypatch.setattr(Servo, "status", property(sticks))
    with pytest.raises(DeviceError) as caught:
        record(control_s=0.3)
    assert str(caught.value).startswith(
        "USE THE EMERGENCY STOP: the run is complete; and could not be disabled: drive hip"
        " (127.0.0.1:"
    )
    assert "was sent the word to disable, but its status word is still 0x0001 after 0.3 s" in str(
        caught.value
    )
    assert (told.count("hip"), told.count("knee")) == (4, 2)


def test_a_drive_that_is_found_enabled_is_disabled_and_the_run_refused(
    record, monkeypatch, tmp_path
):
    served, begin = [], Servo.__init__

    def left_enabled(servo, *arguments):
        begin(servo, *arguments)
        servo._control = ENABLE

    monkeypatch.setattr(Servo, "__init__", left_enabled)
    with pytest.raises(
        DeviceError, match=r"^drive hip \(.*\) and drive knee \(.*\): enabled before the run began"
    ):
        record(served_as=served)
    assert served[0].enabled == [False, False]


def first_drive(rig_file):
    async def made():  # a connection belongs to an event loop
        return Machine(load_rig(rig_file()), with_sensors=False).drives[0]

    return asyncio.run(made())


@pytest.mark.parametrize("angle", [float("nan"), 1.8, -300.0])
def test_no_set_point_goes_out_that_is_no_number_or_outside_the_limits_whoever_sends_it(
    rig_file, angle
):
    drive = first_drive(rig_file)
    with pytest.raises(
        DeviceError, match=r"outside its limits -0\.35 to 1\.75 rad; it was not sent"
    ):
        drive.words(DISABLE, angle)


@pytest.mark.parametrize("angle", [float("nan"), 1.8])
def test_a_drive_whose_angle_is_no_set_point_is_told_the_one_it_holds(rig_file, monkeypatch, angle):
    drive = first_drive(rig_file)
    held = drive.write_block.encode({"reference": 0.3, "control": ENABLE, "heartbeat": 0})

    async def read(device, address, count):
        assert (address, count) == (drive.write_block.address, drive.write_block.count)
        return held

    monkeypatch.setattr(Device, "read", read)
    told = drive.write_block.decode(asyncio.run(drive.idle_words(DISABLE, angle)))
    assert (told["reference"], told["control"]) == (pytest.approx(0.3), DISABLE)


@pytest.mark.parametrize(("angle", "told"), [(1.8, 1.75), (-0.4, -0.35), (float("nan"), 0.0)])
def test_a_drive_whose_set_point_cannot_be_read_is_disabled_all_the_same(
    rig_file, monkeypatch, angle, told
):
    """It is told the nearest set-point within its limits."""
    drive = first_drive(rig_file)

    async def read(device, address, count):
        raise Refused("it has no such register")

    monkeypatch.setattr(Device, "read", read)
    words = drive.write_block.decode(asyncio.run(drive.idle_words(DISABLE, angle)))
    assert (words["reference"], words["control"]) == (pytest.approx(told, abs=1e-3), DISABLE)


def faulty(rig, reset_faults, tmp_path, excitation, serve, port):
    settings = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    with serve(rig, port) as served:
        served.rig.drives[1].servo.fault = True
        acquire(rig, settings, excitation, tmp_path / "test.parquet", reset_faults=reset_faults)


def test_a_fault_is_cleared_where_the_operator_asks_for_it_and_nowhere_else(
    heard, tmp_path, excitation, rig_file, serve
):
    port = free_port()
    with pytest.raises(DeviceError) as caught:
        faulty(rig_file(port=port), False, tmp_path, excitation, serve, port)
    assert (
        "clear the fault and start again, with --reset-faults where the drive is to clear it"
        in str(caught.value)
    )
    assert heard() == [[DISABLE]] * 2
    port = free_port()
    faulty(rig_file(port=port), True, tmp_path, excitation, serve, port)
    assert sorted(heard()[2:]) == sorted(
        [[DISABLE, ENABLE, HALT, DISABLE], [RESET, DISABLE, ENABLE, HALT, DISABLE]]
    )


def test_a_fault_that_the_rig_file_knows_no_word_for_is_not_cleared(
    tmp_path, excitation, rig_file, serve
):
    port = free_port()
    rig = rig_file(port=port, drop=("fault_reset",))
    with pytest.raises(
        SettingsError,
        match=r"map.drive.servo.fault_reset: missing, but drive knee .* reports a fault",
    ):
        faulty(rig, True, tmp_path, excitation, serve, port)


def test_a_drive_is_told_with_every_write_that_the_host_lives(record, monkeypatch):
    beats, hear = [], Drive.receive

    def remember(drive):
        if drive.written and drive.joint == 0:
            start = drive.write.address - drive.first
            told = drive.write.decode(drive.registers[start : start + drive.write.count])
            beats.append(int(told["heartbeat"]))
        hear(drive)

    monkeypatch.setattr(Drive, "receive", remember)
    control = 'control = { address = 202, type = "uint16" }'
    record(
        duration_s=1.0,
        replace={control: f'{control}\nheartbeat = {{ address = 203, type = "uint16" }}'},
    )
    assert beats == list(range(1, len(beats) + 1))
    assert len(beats) > 300
