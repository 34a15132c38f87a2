"""What stops a run: the leg slows down, the drives are disabled, the record is kept, one line says why."""

import json
import time

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pymodbus.constants import ExcCodes

from pipelines.acquisition.journal import journal_of
from pipelines.acquisition.machine import Reading, Row
from pipelines.acquisition.safety import HOLD_SAMPLES, Limits, slowing
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, InputError
from pipelines.rig.server import READ_WRITE, Drive
from pipelines.settings.rig import load_rig

RATE = 200.0


class After:
    """A fault that begins with the n-th exchange of a drive."""

    def __init__(self, exchanges, fault):
        self.left, self.fault = 2 * exchanges, fault  # an exchange is a write and a read

    def __call__(self, device, function, written):
        self.left -= function == READ_WRITE and isinstance(device, Drive) and device.joint == 1
        return self.fault(device, function) if self.left < 0 else None


def aborted(tmp_path):
    return RECORDING.read(tmp_path / "test.aborted.parquet")


def reading(**changes):
    at_rest = dict(
        sequence=0, time=0.0, angle=0.0, torque=0.0, current=0.0, velocity=0.0, temperature=20.0, reference=0.0
    )
    return Reading(**{**at_rest, **changes})


def row(hip=None, knee=None, forces=None):
    return Row((reading(**hip or {}), reading(**knee or {})), np.zeros((4, 3)) if forces is None else forces)


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ({"hip": {"angle": 1.8}}, "hip angle 1.800 rad is outside its limits -0.35 to 1.75 rad"),
        ({"knee": {"velocity": -3.6}}, "knee speed -3.600 rad/s is above its limit of 3.5 rad/s"),
        ({"hip": {"torque": -151.0}}, "hip torque -151.0 N·m is above its limit of 150 N·m"),
        ({"forces": np.where(np.arange(12).reshape(4, 3) == 4, -401.0, np.nan)},
         "thigh_back force y -401 N is above the limit of 400 N"),
    ],
)  # fmt: skip
def test_each_limit_is_watched_at_every_sample(rig_file, found, message):
    limits = Limits(load_rig(rig_file()), RATE)
    assert limits.violation(row()) is None
    assert limits.violation(row(**found)) == message


def test_a_drive_that_tells_no_speed_is_judged_by_its_angles(rig_file):
    limits = Limits(load_rig(rig_file()), RATE)
    still, moved = {"velocity": np.nan}, {"velocity": np.nan, "angle": 0.1, "sequence": 1}
    assert limits.violation(row(hip=still)) is None
    assert limits.violation(row(hip=moved)) == "hip speed 20.000 rad/s is above its limit of 3 rad/s"


@pytest.mark.parametrize("speed", [1.3, -1.3, 0.0])
def test_a_stop_slows_down_no_faster_than_told_and_holds(speed):
    path = np.concatenate([[0.5 - speed / RATE, 0.5], slowing(0.5, speed, 8.0, RATE, (-3.0, 3.0))])
    acceleration = np.diff(path, 2) * RATE**2
    assert np.abs(acceleration).max() <= 8.0 + 1e-6
    assert_allclose(path[-HOLD_SAMPLES:], path[-1])
    assert np.sign(path[-1] - 0.5) == np.sign(speed)


def test_a_stop_never_leaves_the_limits():
    assert slowing(0.99, 2.0, 8.0, RATE, (-1.0, 1.0)).max() == 1.0


@pytest.mark.parametrize(
    ("changes", "run", "words"),
    [({"torque_nm": 5.0}, "exo_alone", "torque"), ({"cuff_force_n": 25.0}, "with_human", "force")],
)
def test_a_broken_limit_ends_the_run_safely_and_keeps_the_record(record, tmp_path, changes, run, words):
    served = []
    # The ramp may break the limit too; then there is nothing to keep, and that is said.
    with pytest.raises(DeviceError) as caught:
        record(run=run, served_as=served, **changes)
    assert words in str(caught.value)
    assert "the leg was stopped" in str(caught.value)
    assert served[0].enabled == [False, False]
    assert not journal_of(tmp_path / "test.parquet").exists()
    assert not (tmp_path / "test.parquet").exists()


def test_an_exception_reply_ends_the_run_with_device_and_registers(record, tmp_path):
    served = []
    with pytest.raises(DeviceError) as caught:
        record(served_as=served, fault=After(300, lambda *_: ExcCodes.DEVICE_FAILURE))
    assert "drive knee (127.0.0.1:" in str(caught.value)
    assert (
        "unit 2): answered an exchange (writing registers 200 to 202, reading 100 to 113) with Modbus exception 4: "
        "it failed; compare the register map in the rig file with the device's manual"
    ) in str(caught.value)
    table = aborted(tmp_path)
    assert "Modbus exception 4" in table.metadata["abort"]
    assert 50 < len(table.frame) < 150
    assert "\n" not in str(caught.value)


def test_a_drive_that_still_answers_is_disabled_when_the_other_is_lost(record):
    served = []

    def knee_fails(device, function):
        return ExcCodes.DEVICE_FAILURE if isinstance(device, Drive) and device.joint == 1 else None

    with pytest.raises(DeviceError) as caught:
        record(served_as=served, fault=After(300, knee_fails))
    assert served[0].enabled[0] is False
    assert "and could not be disabled: drive knee" in str(caught.value)


def test_a_rig_that_stops_half_way_leaves_the_record(record, tmp_path):
    served = []

    def leave(device, function):
        served[0].stop_soon()

    with pytest.raises(DeviceError) as caught:
        record(served_as=served, fault=After(300, leave), watchdog_s=0.3)
    assert "did not answer" in str(caught.value)
    assert len(aborted(tmp_path).frame) > 50


def test_a_counter_that_stands_still_trips_the_watchdog(record, tmp_path):
    def freeze(device, function):
        device.rig.catch_up = lambda: None

    began = time.monotonic()
    with pytest.raises(DeviceError) as caught:
        record(fault=After(300, freeze), watchdog_s=0.3)
    assert "watchdog: no new sample from drive hip" in str(caught.value)
    assert time.monotonic() - began < 30
    assert "watchdog" in aborted(tmp_path).metadata["abort"]


def test_a_fault_bit_ends_the_run(record):
    def complain(device, function):
        device.rig.enabled = np.array([8, 8])

    with pytest.raises(DeviceError) as caught:
        record(fault=After(10, complain))
    assert "reports a fault (status bits 0x0008); see the drive's manual" in str(caught.value)


def test_a_clock_in_another_unit_than_the_rig_file_says_is_noticed(record):
    with pytest.raises(DeviceError) as caught:
        record(replace={"seed = 1": "sample_rate_hz = 100.0\nseed = 1"})
    assert "samples 100 times a second by its own clock, expected 200" in str(caught.value)


def test_a_trajectory_outside_the_limits_is_refused_before_anything_moves(record):
    served = []
    with pytest.raises(InputError) as caught:
        record(served_as=served, replace={"angle_rad = [-0.35, 1.75]": "angle_rad = [-0.35, 0.6]"})
    assert "excitation.toml: the hip would be at 0.58" in str(caught.value)
    assert "but the rig allows -0.33 to 0.58 rad (its limits less angle_margin_rad)" in str(caught.value)
    assert served[0].rig.sample.sequence[0] == 0


def test_a_leg_that_stands_outside_its_limits_is_not_moved(record):
    served = []
    with pytest.raises(DeviceError) as caught:
        record(served_as=served, replace={"angle_rad = [-2.1, 0.35]": "angle_rad = [-2.1, -0.2]"})
    assert str(caught.value) == (
        "the knee stands at 0.000 rad, outside its limits -2.1 to -0.2 rad; move the leg by hand, or check the "
        "encoder's zero"
    )
    assert served[0].rig.sample.sequence[0] == 0


def test_another_device_than_the_rig_file_describes_is_refused(record):
    with pytest.raises(DeviceError) as caught:
        record(believed={"address = 0, value = 0x4558": "address = 0, value = 0x4559"})
    assert "unit 1): identity register 0 holds 0x4558, expected 0x4559: it is another device" in str(caught.value)


def test_a_rig_that_is_not_there_is_named_with_its_address(record):
    with pytest.raises(DeviceError) as caught:
        record(believed={"unit = 2": 'unit = 2\nhost = "127.0.0.9"'})
    assert "drive knee (127.0.0.9:" in str(caught.value)
    assert str(caught.value).endswith(
        "unit 2): refuses the connection; check that the rig is on, and host and port in the rig file"
    )


def test_nothing_sealed_is_in_a_recording_of_a_rig_that_hides_something(record, tmp_path):
    (tmp_path / "secret_file.toml").write_text(
        "seed = 987654\n[[possibility]]\neffect = 'encoder_offset'\njoints = ['knee']\n"
        "values = { offset = [0.1, 0.1] }\n"
    )
    table = record(replace={"[plant]": '[plant]\nsealed = "secret_file.toml"'})
    told = json.dumps(table.metadata) + " ".join(table.frame.columns)
    for secret in ("secret_file", "987654", "encoder_offset", "inertial", "coulomb", "sealed", "plant"):
        assert secret not in told
