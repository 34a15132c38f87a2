"""What a virtual drive makes of set-points that come early, late or not at all."""

import numpy as np
import pytest

from pipelines.rig.servo import EXTRAPOLATED, Servo
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RATE = 1000.0


@pytest.fixture
def servo():
    def make(samples_per_cycle):
        registers = load_rig(datasets() / "rigs" / "recorder.toml").map.drive["servo"]
        return Servo(
            registers, 0.0, (-3.0, 3.0), RATE, 8.0, None, samples_per_cycle
        ), registers.enable

    return make


@pytest.mark.parametrize("cycle", [1, 5, 20])
def test_a_set_point_is_reached_in_a_straight_line_within_its_cycle(servo, cycle):
    drive, enable = servo(cycle)
    drive.receive(0.0, enable)
    for _ in range(cycle):
        drive.next(0.0)
    drive.receive(0.1, enable)
    path = [drive.next(0.0)[0] for _ in range(cycle)]
    np.testing.assert_allclose(path, 0.1 * np.arange(1, cycle + 1) / cycle)


def speeds(drive, enable, came):
    """Speeds of a drive whose set-points, 0.001 rad a sample, come at samples; None is left out."""
    path, now = [], 0
    for number, sample in enumerate(came):
        if sample is not None:
            path += [drive.next(0.0)[0] for _ in range(sample - now)]
            drive.receive(0.005 * number, enable)
            now = sample
    return np.diff(path)


@pytest.mark.parametrize("phase", range(5))
def test_set_points_that_come_a_sample_early_or_late_move_the_drive_no_less_evenly(servo, phase):
    came = 5 * np.arange(400) + phase + np.random.default_rng(phase).integers(-1, 2, 400)
    # Once it is in step with them it goes at their speed, and at no other: its cycles follow them
    # but slowly.
    np.testing.assert_allclose(speeds(*servo(5), came)[100:], 0.001, rtol=0.05)


@pytest.mark.parametrize("late", [1, 2, 3])
def test_a_set_point_that_comes_late_now_and_then_does_not_jerk_the_drive(servo, late):
    came = 5 * np.arange(400)
    came[20::20] += late
    np.testing.assert_allclose(speeds(*servo(5), came)[50:], 0.001, rtol=0.05)


@pytest.mark.parametrize("left_out", [1, 2, 3])
def test_a_drive_goes_on_evenly_where_set_points_are_left_out(servo, left_out):
    came = [None if 0 < k % 20 <= left_out else 5 * k for k in range(400)]
    np.testing.assert_allclose(speeds(*servo(5), came)[50:], 0.001, rtol=1e-6)


@pytest.mark.parametrize("cycle", [1, 5, 20])
def test_set_points_that_come_irregularly_do_not_swing_the_drive_up(servo, cycle):
    drive, enable = servo(cycle)
    draw, now, path = np.random.default_rng(0), 0, []
    for _ in range(400):
        drive.receive(0.02 * np.sin(2 * np.pi * now / RATE), enable)
        late = int(draw.choice([cycle, max(cycle - 2, 1), cycle + 3, 7 * cycle, 20 * cycle]))
        path += [drive.next(0.0)[0] for _ in range(late)]
        now += late
    # At most at its highest speed for as long as it goes on by itself, and until it has slowed
    # down.
    fastest = 0.02 * 2 * np.pi
    assert np.abs(path).max() < 0.02 + fastest * EXTRAPOLATED * cycle / RATE + fastest**2 / 8.0


def test_a_drive_of_the_shipped_template_reports_no_fault_while_it_is_merely_disabled():
    registers = load_rig(datasets() / "rigs" / "lab.toml").map.drive["servo"]
    assert registers.enabled_mask & registers.fault_mask  # as CiA 402 has it
    drive = Servo(registers, 0.0, (-3.0, 3.0), RATE, 8.0, None)
    drive.receive(0.0, registers.disable)
    assert not drive.status & registers.fault_mask
    assert drive.status & registers.enabled_mask != registers.enabled_value
    drive.receive(0.0, registers.enable)
    assert drive.status & registers.enabled_mask == registers.enabled_value
    drive.fault = True
    assert drive.status & registers.fault_mask
    assert drive.status & registers.enabled_mask != registers.enabled_value
