"""What stops a run: the leg slows down, the drives are disabled, the record is kept, one line says
why."""

import json
import re
import time
from dataclasses import replace

import numpy as np
import pytest
from pymodbus.constants import ExcCodes

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.modbus.device import Device as Line
from pipelines.acquisition.plan import make_plan
from pipelines.acquisition.preconditions.set_point_scale import refuse_contradictory_set_points
from pipelines.acquisition.safety.limits import HOLD_SAMPLES, Limits, refuse_leap, slowed
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import DeviceError, ExoidError, InputError, SettingsError
from pipelines.rig.device import READ_WRITE, Drive, Sensor
from pipelines.rig.servo import Servo
from pipelines.settings.rig import load_rig
from tests.acquisition.journals import read_journal

RATE = 200.0


class After:
    """A fault that begins with the n-th exchange of a drive."""

    def __init__(self, exchanges, fault):
        self.left, self.fault = 2 * exchanges, fault  # an exchange is a write and a read

    def __call__(self, device, function, written):
        self.left -= function == READ_WRITE and isinstance(device, Drive) and device.joint == 1
        return self.fault(device, function) if self.left < 0 else None


@pytest.fixture
def stopped(record):
    """Record a run that is stopped; whatever the cause, every drive that can be reached is disabled
    at its end."""

    def run(within_reach=(0, 1), raises=DeviceError, **arguments):
        served = arguments.setdefault("served_as", [])
        with pytest.raises(raises) as caught:
            record(**arguments)
        assert type(caught.value) is raises
        assert [served[0].enabled[j] for j in within_reach] == [False] * len(within_reach)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return run


def aborted(tmp_path):
    return RECORDING.read(tmp_path / "test.aborted.parquet")


def reading(**changes):
    at_rest = dict(
        sequence=0,
        time=0.0,
        angle=0.0,
        torque=0.0,
        current=0.0,
        velocity=0.0,
        temperature=20.0,
        reference=0.0,
    )
    return Reading(**{**at_rest, **changes})


def row(hip=None, knee=None, forces=None):
    return Row(
        (reading(**hip or {}), reading(**knee or {})),
        np.zeros((4, 3)) if forces is None else forces,
    )


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ({"hip": {"angle": 1.8}}, "hip angle 1.800 rad is outside its limits -0.35 to 1.75 rad"),
        ({"knee": {"velocity": -3.6}}, "knee speed -3.600 rad/s is above its limit of 3.5 rad/s"),
        ({"hip": {"torque": -151.0}}, "hip torque -151.0 N·m is above its limit of 150 N·m"),
        (
            {"forces": np.array([[np.nan] * 3, [0.0, -401.0, 0.0], [np.nan] * 3, [np.nan] * 3])},
            "thigh_back force y -401 N is above the limit of 400 N",
        ),
        (
            {"forces": np.array([[np.nan] * 3, [0.0, 0.0, np.nan], [np.nan] * 3, [np.nan] * 3])},
            "thigh_back force z nan N is above the limit of 400 N",
        ),
        ({"knee": {"angle": np.nan}}, "knee angle nan rad is outside its limits -2.1 to 0.35 rad"),
        ({"hip": {"torque": np.nan}}, "hip torque nan N·m is above its limit of 150 N·m"),
    ],
)
def test_each_limit_is_watched_at_every_sample(rig_file, found, message):
    limits = Limits(load_rig(rig_file()), RATE)
    assert limits.violation(row()) is None
    assert limits.violation(row(**found)) == message


def test_a_drive_that_tells_no_speed_is_judged_by_its_angles(rig_file):
    limits = Limits(load_rig(rig_file()), RATE)
    still, moved = {"velocity": np.nan}, {"velocity": np.nan, "angle": 0.1, "sequence": 1}
    assert limits.violation(row(hip=still)) is None
    assert (
        limits.violation(row(hip=moved)) == "hip speed 20.000 rad/s is above its limit of 3 rad/s"
    )


@pytest.mark.parametrize("speed", [1.3, -1.3, 0.0])
def test_a_stop_slows_down_no_faster_than_told_to_rest(speed):
    path, left = [0.5 - speed / RATE, 0.5], speed
    for _ in range(50):
        reference, left = slowed(path[-1], left, 8.0, 1 / RATE)
        path.append(reference)
    assert np.abs(np.diff(path, 2) * RATE**2).max() <= 8.0 + 1e-6
    assert left == 0.0
    assert path[-1] - 0.5 == pytest.approx(np.sign(speed) * speed**2 / 2 / 8.0)


@pytest.mark.parametrize(
    ("changes", "run", "words"),
    [({"torque_nm": 5.0}, "exo_alone", "torque"), ({"cuff_force_n": 25.0}, "with_human", "force")],
)
def test_a_broken_limit_ends_the_run_safely_and_keeps_the_record(
    stopped, tmp_path, changes, run, words
):
    # The ramp may break the limit too; then there is nothing to keep, and that is said.
    why = stopped(run=run, **changes)
    assert words in why
    assert "the leg was stopped" in why
    assert not journal_of(tmp_path / "test.parquet").exists()
    assert not (tmp_path / "test.parquet").exists()


def refuse_exchanges(device, function):
    return ExcCodes.DEVICE_FAILURE if function == READ_WRITE else None


def test_an_exception_reply_ends_the_run_with_device_and_registers(stopped, tmp_path):
    why = stopped(fault=After(300, refuse_exchanges))
    assert "drive knee (127.0.0.1:" in why
    assert (
        "unit 2): answered an exchange (writing registers 200 to 202, reading 100 to 113) with"
        " Modbus exception 4: it failed; see the device's manual and its own display" in why
    )
    table = aborted(tmp_path)
    assert "Modbus exception 4" in table.metadata["abort"]
    assert 50 < len(table.frame) < 150


def test_a_drive_that_still_answers_is_disabled_when_the_other_is_lost(stopped):
    def knee_fails(device, function):
        return ExcCodes.DEVICE_FAILURE if isinstance(device, Drive) and device.joint == 1 else None

    assert "and could not be disabled: drive knee" in stopped(
        fault=After(300, knee_fails), within_reach=[0]
    )


def test_a_drive_whose_line_breaks_is_disabled_on_a_new_one(stopped, monkeypatch):
    write, tried = Line.write, []

    async def breaks(line, block, words, **how):
        tried.append(line.label)
        if tried.count(line.label) == 2:  # the first one is that before the run
            line.line.close()
        await write(line, block, words, **how)

    monkeypatch.setattr(Line, "write", breaks)
    assert "could not be disabled" not in stopped(fault=After(300, refuse_exchanges))
    assert len(tried) == 2 + 4


def test_what_goes_wrong_with_one_drives_stop_neither_hides_nor_hinders_the_other(
    stopped, monkeypatch
):
    encode, disable = Line.exchange, Line.write

    async def fails(line, *arguments, **how):
        if "hip" in line.label and broken:
            raise ValueError("no number")
        await disable(line, *arguments, **how)

    async def exchange(line, *arguments):
        if "hip" in line.label and broken:
            raise ValueError("no number")
        return await encode(line, *arguments)

    broken = []
    monkeypatch.setattr(Line, "write", fails)
    monkeypatch.setattr(Line, "exchange", exchange)
    why = stopped(
        fault=After(300, lambda *_: broken.append(True)), within_reach=[1], raises=ExoidError
    )
    assert "a fault of exoid's own (ValueError('no number'))" in why
    assert "and could not be disabled: drive hip (127.0.0.1:" in why
    assert why.startswith("USE THE EMERGENCY STOP: ")


@pytest.mark.parametrize("still_pressed", [True, False])
def test_where_a_cuff_still_presses_the_drives_are_disabled_without_slowing_down(
    stopped, still_pressed
):
    exchanges, pressed = [], []

    def press(device, function):
        if function == READ_WRITE:
            exchanges.append(device.joint)
        force = 500.0 if still_pressed or len(pressed) < 1 else 0.0
        if isinstance(device, Sensor):
            pressed.append(force)
            device.show = lambda true: Sensor.show(
                device, replace(true, forces=np.full((1, 4, 3), force))
            )

    assert "force x 500 N is above the limit" in stopped(run="with_human", fault=After(300, press))
    # An exchange is a write and a read of each of two drives.
    assert (len(exchanges) < 4 * HOLD_SAMPLES) == still_pressed


def test_a_recording_that_cannot_be_written_does_not_hide_why_the_run_was_stopped(
    stopped, tmp_path, monkeypatch
):
    def freeze(device, function):
        device.rig.catch_up = lambda: None

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pipelines.acquisition.run_outcome.write_recording", full)
    why = stopped(fault=After(300, freeze), watchdog_s=0.3, duration_s=3.0)
    journal = journal_of(tmp_path / "test.parquet")
    assert why.startswith("watchdog: no new sample from drive hip")
    assert (
        f"its samples are in {journal}, but could not be written as a recording: [Errno 28] No"
        " space left" in why
    )
    assert len(read_journal(journal)[0]) > 50


def test_a_register_that_tells_no_number_ends_the_run_before_that_is_recorded(stopped, tmp_path):
    """A recording that holds an infinity could not be written."""
    was = 'temperature = { address = 112, type = "int16", scale = 0.1'
    hot = {was: 'temperature = { address = 114, type = "float32", scale = 1.0'}

    def burn(device, function):
        shows(device, lambda true: replace(true, temperature=np.inf * true.temperature))

    why = stopped(fault=After(300, burn), replace=hot, duration_s=3.0)
    assert "drive hip (127.0.0.1:" in why
    assert "its temperature is inf, expected a number" in why
    assert np.isfinite(aborted(tmp_path).frame["hip_temperature_c"]).all()


def test_a_fault_of_our_own_stops_the_leg_ends_with_exit_code_1_and_keeps_its_traceback(
    stopped, tmp_path, monkeypatch
):
    def fails(limits, told):
        if told.drives[0].sequence > 300:
            raise ZeroDivisionError("a bug")
        return None

    monkeypatch.setattr(Limits, "cuff_violation", fails)
    why = stopped(raises=ExoidError)
    samples, log = len(aborted(tmp_path).frame), tmp_path / "test.aborted.log"
    assert (
        why
        == f"a fault of exoid's own (ZeroDivisionError('a bug')); please report it with {log}; the"
        f" leg was stopped, its {samples} samples so far are in"
        f" {tmp_path / 'test.aborted.parquet'}"
    )
    assert 'raise ZeroDivisionError("a bug")' in log.read_text()
    assert (
        aborted(tmp_path).metadata["abort"] == "a fault of exoid's own (ZeroDivisionError('a bug'))"
    )
    assert ExoidError.exit_code == 1


def test_a_full_disk_stops_the_leg_and_is_told(stopped, monkeypatch):
    def full(journal):
        if journal.rows > 50:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("pipelines.acquisition.recording.journal.Journal.flush", full)
    why = stopped(watchdog_s=0.5, duration_s=4.0)
    assert (
        "test.parquet.journal: cannot be written ([Errno 28] No space left on device); make room,"
        " then" in why
    )


def test_a_rig_that_stops_half_way_leaves_the_record(stopped, tmp_path):
    served = []

    def leave(device, function):
        served[0].stop_soon()

    why = stopped(served_as=served, fault=After(300, leave), watchdog_s=0.3, within_reach=[])
    assert "the line is lost" in why
    assert "and could not be disabled: drive hip" in why
    assert len(aborted(tmp_path).frame) > 50


def test_a_counter_that_stands_still_trips_the_watchdog(stopped, tmp_path):
    def freeze(device, function):
        device.rig.catch_up = lambda: None

    began = time.monotonic()
    assert "watchdog: no new sample from drive hip" in stopped(
        fault=After(300, freeze), watchdog_s=0.3
    )
    assert time.monotonic() - began < 30
    assert "watchdog" in aborted(tmp_path).metadata["abort"]


def test_a_fault_bit_ends_the_run(stopped):
    def complain(device, function):
        device.rig.drives[1].servo.fault = True

    assert "reports a fault (status bits 0x0008); see the drive's manual" in stopped(
        fault=After(10, complain)
    )
    named = {"fault_mask = 0x0008": 'faults = { 3 = "over-current" }\nfault_mask = 0x0008'}
    why = stopped(fault=After(10, complain), replace=named)
    assert "reports a fault (status bits 0x0008: over-current); see the drive's manual" in why


def test_a_clock_in_another_unit_than_the_rig_file_says_is_noticed(stopped):
    why = stopped(replace={"seed = 1": "sample_rate_hz = 100.0\nseed = 1"})
    assert "samples 100 times a second by its own clock, expected 200" in why


@pytest.mark.parametrize("rate_hz", [80.0, 100.0, 400.0])
def test_drives_that_sample_at_another_rate_are_refused_before_they_are_enabled(
    stopped, monkeypatch, rate_hz
):
    words, hear = set(), Servo.receive

    def remember(servo, reference, control):
        words.add(control)
        hear(servo, reference, control)

    monkeypatch.setattr(Servo, "receive", remember)
    why = stopped(shipped="real_time", rate_hz=rate_hz)
    by_counter = (
        rf"its sample counter goes up by \d{{3}}(\.\d)? a second, expected {rate_hz:g}; correct"
        " acquire.sample_rate_hz, or the rate in the drive"
    )
    # Where a busy computer cannot measure the rate, the drive's own clock shows it.
    by_clock = (
        rf"its clock went on by \d\.\d+ s while .* samples of {1 / rate_hz:.6f} s; correct the unit"
        " of time in the rig file, or acquire.sample_rate_hz"
    )
    assert re.match(rf"drive (hip|knee) .*: ({by_counter}|{by_clock}); nothing was moved", why)
    assert words == {0}  # disabled


def test_a_clock_that_does_not_keep_time_is_refused_before_the_drives_are_enabled(stopped):
    why = stopped(shipped="real_time", believed={'unit = "us"': 'unit = "ms"'})
    assert "s while its counter went on by" in why
    assert "nothing was moved" in why


def shows(device, sample):
    """Let every device show another sample than the plant's; ``sample`` makes it of the true one.

    It begins with the hip, which is asked first, so that both drives agree in what they show.
    """
    for each in device.rig.drives if device is device.rig.drives[0] else ():
        each.show = lambda true, each=each: type(each).show(each, sample(true))


@pytest.mark.parametrize("shipped", ["plain", "real_time"])
@pytest.mark.parametrize(
    ("counter", "words"),
    [
        (lambda count: 0 * count, "its sample counter went back from"),
        (lambda count: count + 900, "its sample counter leapt from"),
    ],
)
@pytest.mark.usefixtures("any_rate")
def test_a_counter_that_leaps_either_way_ends_the_run_before_a_set_point_follows_it(
    stopped, shipped, counter, words
):
    served, sent = [], []

    def leap(device, function):
        shows(device, lambda true: replace(true, sequence=counter(true.sequence)))
        hip = device.rig.drives[0].servo
        sent.extend([hip._set_point] if hip.enabled else [])

    why = stopped(
        shipped=shipped,
        served_as=served,
        fault=After(150, leap),
        rate_hz=50.0,
        duration_s=4.0,
        torque_nm=1000.0,
        speed_rad_s=50.0,
        replace={"seed = 1 ": "sample_rate_hz = 50.0\nseed = 1 "},
    )
    assert words in why
    # What the speed limit allows, and some missed samples.
    assert np.abs(np.diff(sent)).max() < 3.0 * 3 / 50


def test_a_clock_that_stands_still_ends_the_run_and_what_was_recorded_is_kept(stopped, tmp_path):
    why = stopped(
        fault=After(
            300, lambda device, _: shows(device, lambda true: replace(true, time=0 * true.time + 1))
        )
    )
    assert "drive hip (127.0.0.1:" in why
    assert "its clock went from 1." in why
    assert len(aborted(tmp_path).frame) > 50


def test_a_glitch_of_the_encoder_is_told_and_is_not_in_the_record(stopped, tmp_path):
    fault = After(
        300, lambda device, _: shows(device, lambda true: replace(true, angle=true.angle + 100.0))
    )
    assert "hip angle 100." in stopped(fault=fault)
    table = aborted(tmp_path)
    assert "is outside its limits" in table.metadata["abort"]
    assert table.frame["hip_angle_rad"].abs().max() < 2.0


@pytest.mark.parametrize("silence", ["counter", "number"])
def test_a_cuff_sensor_that_falls_silent_ends_the_run(stopped, silence):
    began = []

    def fall_silent(device, function):
        if not began:
            began.append(device.rig.sample.sequence)
            nothing = (
                {"sequence": began[0]}
                if silence == "counter"
                else {"forces": np.full((1, 4, 3), np.nan)}
            )
            for sensor in device.rig.sensors:
                sensor.show = lambda true, sensor=sensor: Sensor.show(
                    sensor, replace(true, **nothing)
                )

    why = stopped(run="with_human", fault=After(300, fall_silent), watchdog_s=0.2)
    assert "watchdog: no new sample from sensor thigh_front (127.0.0.1:" in why
    assert (
        "allowed are 0.2 s (safety.watchdog_s): its counter stands still or its forces are" in why
    )


@pytest.mark.parametrize("angle", [np.nan, 1.8, 0.52])
def test_no_set_point_is_sent_that_is_no_number_or_beyond_a_limit_or_too_far_from_the_last(
    rig_file, angle
):
    drive = load_rig(rig_file()).drive[0]
    refuse_leap(drive, 0.5, 0.514, 1 / RATE)
    with pytest.raises(DeviceError, match="it was not sent"):
        refuse_leap(drive, 0.5, angle, 1 / RATE)


def test_a_leg_that_moves_before_the_drives_are_enabled_is_left_alone(stopped, monkeypatch):
    served, planned = [], make_plan

    def plan_while_it_moves(*arguments):
        shows(served[0].rig.drives[0], lambda true: replace(true, angle=true.angle + 0.1))
        return planned(*arguments)

    monkeypatch.setattr("pipelines.acquisition.acquire.make_plan", plan_while_it_moves)
    assert "the hip moved from 0.000 to 0.100 rad before its drive was enabled" in stopped(
        served_as=served
    )
    assert served[0].rig.sample.sequence[0] == 0


def test_a_trajectory_outside_the_limits_is_refused_before_anything_moves(record):
    served = []
    with pytest.raises(InputError) as caught:
        record(served_as=served, replace={"angle_rad = [-0.35, 1.75]": "angle_rad = [-0.35, 0.6]"})
    assert "excitation.toml: the hip would be at 0.58" in str(caught.value)
    assert "but the rig allows -0.33 to 0.58 rad (its limits less angle_margin_rad)" in str(
        caught.value
    )
    assert served[0].rig.sample.sequence[0] == 0


def test_a_leg_that_stands_outside_its_limits_is_not_moved(record):
    served = []
    with pytest.raises(DeviceError) as caught:
        record(served_as=served, replace={"angle_rad = [-2.1, 0.35]": "angle_rad = [-2.1, -0.2]"})
    assert (
        str(caught.value)
        == "the knee stands at 0.000 rad, outside its limits -2.1 to -0.2 rad; move the leg by"
        " hand, or check the encoder's zero"
    )
    assert served[0].rig.sample.sequence[0] == 0


def test_another_device_than_the_rig_file_describes_is_refused(record):
    with pytest.raises(DeviceError) as caught:
        record(believed={"address = 0, value = 0x4558": "address = 0, value = 0x4559"})
    assert (
        "unit 1): identity register 0 holds 0x4558, expected 0x4559: it is another device"
        in str(caught.value)
    )


def test_a_rig_that_is_not_there_is_named_with_its_address(record):
    with pytest.raises(DeviceError) as caught:
        record(believed={"unit = 2": 'unit = 2\nhost = "127.0.0.9"'})
    assert "drive knee (127.0.0.9:" in str(caught.value)
    assert str(caught.value).endswith(
        "unit 2): refuses the connection; check that the rig is on, and host and port in the rig"
        " file"
    )


def test_nothing_sealed_is_in_a_recording_of_a_rig_that_hides_something(record, tmp_path):
    (tmp_path / "secret_file.toml").write_text(
        "seed = 987654\n[[possibility]]\neffect = 'encoder_offset'\njoints = ['knee']\n"
        "values = { offset = [0.1, 0.1] }\n"
    )
    table = record(replace={"[plant]": '[plant]\nsealed = "secret_file.toml"'})
    told = json.dumps(table.metadata) + " ".join(table.frame.columns)
    for secret in (
        "secret_file",
        "987654",
        "encoder_offset",
        "inertial",
        "coulomb",
        "sealed",
        "plant",
    ):
        assert secret not in told


def test_a_drive_that_would_be_sent_to_the_mirror_image_of_where_it_stands_is_refused(record):
    served, written = (
        [],
        'reference = { address = 200, type = "int32", scale = 1e-6, unit = "rad" }',
    )
    with pytest.raises(SettingsError) as caught:
        record(served_as=served, replace={written: written.replace("1e-6", "-1e-6")})
    assert "write.reference.scale: found -1e-06 with 1e-06 of read.angle" in str(caught.value)
    assert not any(drive.servo.enabled for drive in served[0].rig.drives)


WRITTEN = 'reference = { address = 200, type = "int32", scale = 1e-6, unit = "rad" }'


@pytest.mark.parametrize(
    ("written", "found"),
    [
        (WRITTEN.replace("1e-6", "4e-6"), "scale: found 4e-06 rad with 1e-06 rad"),
        (WRITTEN.replace('"rad"', '"deg"'), "unit: found deg with rad"),
        (
            WRITTEN.replace("1e-6", "1e-4").replace('"rad"', '"deg"'),
            "scale: found 0.0001 deg with 1e-06 rad",
        ),
        (WRITTEN.replace("unit", "offset = 0.05, unit"), "offset: found 0.05 rad with 0 rad"),
        (
            WRITTEN.replace("unit", 'word_order = "little", unit'),
            "word_order: found little with big",
        ),
        (
            WRITTEN.replace("unit", 'byte_order = "little", unit'),
            "byte_order: found little with big",
        ),
        (WRITTEN.replace('"int32", scale = 1e-6', '"float32"'), "type: found float32 with int32"),
    ],
)
def test_a_drive_that_would_be_sent_elsewhere_than_where_it_stands_is_refused_unless_that_is_meant(
    rig_file, written, found
):
    with pytest.raises(
        SettingsError,
        match=f"map.drive.servo.write.reference.{found} of read.angle, expected the same",
    ):
        refuse_contradictory_set_points(load_rig(rig_file(replace={WRITTEN: written})))
    meant = {WRITTEN: written, "enable = 0x000F": "own_scale = true\nenable = 0x000F"}
    refuse_contradictory_set_points(load_rig(rig_file(replace=meant)))


def test_set_points_may_be_told_in_another_unit_than_angles_where_a_count_is_the_same_angle(
    rig_file,
):
    written = WRITTEN.replace("1e-6", "5.72957795e-5").replace('"rad"', '"deg"')
    refuse_contradictory_set_points(load_rig(rig_file(replace={WRITTEN: written})))
