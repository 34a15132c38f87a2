"""What a virtual drive makes of control words and of silence."""

import numpy as np
import pytest

from pipelines.rig.servo import EXTRAPOLATED, Servo
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RATE, SLOWING, HEARTBEAT_S = 200.0, 8.0, 0.5
ENABLE, DISABLE, HALT, RESET = 0x000F, 0x0000, 0x010F, 0x0080


@pytest.fixture
def servo():
    registers = load_rig(datasets() / "rigs" / "plain.toml").map.drive["servo"]
    return Servo(registers, 0.0, (-0.35, 1.75), RATE, SLOWING, HEARTBEAT_S)


def moving(servo, speed=1.6, samples=100):
    """Lead a servo along a ramp; return where it is."""
    for k in range(samples):
        servo.receive(k * speed / RATE, ENABLE)
        servo.next(0.0)
    return (samples - 1) * speed / RATE


def test_a_drive_without_set_points_goes_on_for_a_moment_slows_down_and_disables_itself(servo):
    last = moving(servo)
    path, enabled = np.transpose([servo.next(0.0) for _ in range(round(HEARTBEAT_S * RATE))])
    path = np.concatenate([[last], path])
    step = np.diff(path) * RATE
    np.testing.assert_allclose(step[:EXTRAPOLATED], 1.6)
    assert np.diff(step).min() * RATE >= -SLOWING - 1e-6
    at_rest = EXTRAPOLATED + int(np.ceil(1.6 / SLOWING * RATE))
    assert (step[at_rest:] == 0).all()
    # It was sent a set-point one sample before the first of these.
    assert enabled[:-1].all()
    assert not enabled[-1]
    assert servo.status == 0x0008


def test_a_drive_that_gets_a_set_point_in_time_goes_on(servo):
    moving(servo)
    for _ in range(round(HEARTBEAT_S * RATE) - 1):
        servo.next(0.0)
    servo.receive(0.7, ENABLE)
    assert servo.next(0.0) == (0.7, True)


def test_a_drive_without_a_watchdog_holds_for_ever(servo):
    registers = load_rig(datasets() / "rigs" / "plain.toml").map.drive["servo"]
    patient = Servo(registers, 0.0, (-0.35, 1.75), RATE, SLOWING, None)
    moving(patient)
    assert all(enabled for _, enabled in [patient.next(0.0) for _ in range(5000)])


def test_a_drive_that_goes_on_by_itself_stays_within_its_joints_limits(servo):
    moving(servo, speed=3.4, samples=102)
    assert max(servo.next(0.0)[0] for _ in range(90)) == 1.75


def test_a_fault_is_latched_until_it_is_reset_and_a_reset_alone_does_not_enable(servo):
    servo.receive(0.0, ENABLE)
    servo.fault = True
    assert not servo.enabled
    servo.receive(0.0, DISABLE)
    servo.receive(0.0, ENABLE)
    assert (servo.enabled, servo.status) == (False, 0x0008)
    servo.receive(0.0, RESET)
    assert (servo.enabled, servo.status) == (False, 0x0000)
    servo.receive(0.0, ENABLE)
    assert (servo.enabled, servo.status) == (True, 0x0001)


def test_a_halted_drive_stands_whatever_its_set_point(servo):
    last = moving(servo)
    servo.receive(last + 0.3, HALT)
    assert servo.next(0.0) == (last, True)


def test_a_disabled_drive_begins_where_its_joint_is(servo):
    assert servo.next(0.4) == (0.4, False)
