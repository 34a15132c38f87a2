"""What exchanges bring and what a drive's own record holds of the same samples must not contradict
each other."""

import numpy as np
import pytest

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.safety.record_agreement import COMPARED, RecordAgreement
from pipelines.errors import DeviceError
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RATE_HZ = 1000.0
RIG = load_rig(datasets() / "rigs" / "recorder.toml")


def reading(k, angle=0.0, torque=0.0, velocity=0.0):
    return Reading(
        k, k / RATE_HZ, angle, torque, torque / 12.0, velocity, 20.0, np.nan, enabled=True
    )


def judged(recorded_torque, exchanged_torque=lambda k: 10.0 * np.sin(0.1 * k), count=3 * COMPARED):
    agreement = RecordAgreement(RIG, 0, RATE_HZ)
    for k in range(count):
        agreement.add(reading(k, torque=exchanged_torque(k)))
        agreement.check(reading(k, torque=recorded_torque(k)))


@pytest.mark.parametrize("factor", [-1.0, 0.5, 2.0, 0.0])
def test_a_record_of_currents_of_another_sign_or_scale_ends_the_run(factor):
    with pytest.raises(
        DeviceError,
        match=(
            r"drive hip.*: reports a torque of .* N·m rms over 50 samples, while its own record"
            r" holds .*record\.current"
        ),
    ):
        judged(lambda k: factor * 10.0 * np.sin(0.1 * k))


def test_a_current_that_one_account_filters_is_the_same_all_the_same():
    noise = np.random.default_rng(0).normal(0.0, 2.0, 3 * COMPARED)
    judged(lambda k: 10.0 * np.sin(0.1 * k) + noise[k])
    judged(lambda k: 10.0 * np.sin(0.1 * (k - 3)))


def test_of_a_torque_that_is_hardly_there_or_is_not_recorded_nothing_is_said():
    judged(lambda k: -0.5, lambda k: 0.5)
    judged(lambda k: np.nan)


def test_an_angle_of_another_zero_ends_the_run_and_one_that_was_latched_a_sample_later_does_not():
    agreement = RecordAgreement(RIG, 0, RATE_HZ)
    agreement.add(reading(1, angle=0.3, velocity=2.0))
    agreement.check(reading(1, angle=0.302))
    agreement.add(reading(2, angle=0.3))
    with pytest.raises(
        DeviceError,
        match=(
            r"reports angle 0\.3 rad of sample 2,"
            r" while its own record holds 0\.35 rad"
        ),
    ):
        agreement.check(reading(2, angle=0.35))
    agreement.check(reading(3, angle=1.0))  # of which no exchange told
