"""A rate that devices or the computer cannot keep is found out before a drive is enabled."""

import time

import pytest

from pipelines.errors import DeviceError

RATE_HZ = 50.0
AT_RATE = {"seed = 1 ": f"sample_rate_hz = {RATE_HZ:g}\nseed = 1 "}
EXCHANGE = 23


@pytest.fixture
def slowly(record):
    """Record at 50 Hz on a rig that takes its time; returns why that was refused, and which devices
    were written to."""

    def run(takes_s, who, run):
        written, seen = set(), []

        def slow(device, function, words):
            written.update({device} if function == EXCHANGE else ())
            if seen and device in getattr(seen[0].rig, who):
                time.sleep(takes_s)

        with pytest.raises(DeviceError) as refused:
            record(
                shipped="real_time",
                run=run,
                rate_hz=RATE_HZ,
                replace=AT_RATE,
                fault=slow,
                served_as=seen,
                torque_nm=1e4,
                cuff_force_n=1e4,
                speed_rad_s=50.0,
            )
        return str(refused.value), written

    return run


def test_a_rate_that_is_too_high_for_the_drives_is_refused_before_any_is_sent_anything(slowly):
    why, written = slowly(0.011, "drives", "exo_alone")
    assert (
        "cycles with all devices took longer than the 20 ms from one set-point to the next" in why
    )
    assert why.endswith("lower acquire.sample_rate_hz, or close other programs; nothing was moved")
    assert not written


def test_where_it_is_sensors_that_take_long_reading_them_less_often_is_named(slowly):
    why, written = slowly(0.008, "sensors", "with_human")
    assert "raise `every` of the sensors" in why
    assert not written
