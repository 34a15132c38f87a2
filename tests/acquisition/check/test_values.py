"""Values that a device renews too slowly, and rows that were only read late."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.acquisition.check.probe import Series
from pipelines.acquisition.check.values import check_values
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register

RATE_HZ = 100.0
PROBE = SimpleNamespace(name="elbow", map_path="map.drive.plc")


def angles(new_hz, late_s, seed):
    """Return the answers of a device that swings, read about each millisecond."""
    waits = np.random.default_rng(seed).exponential(late_s, 1500)
    answered = np.cumsum(0.0005 + waits)
    renewed = np.floor(answered * new_hz + 1e-9) / new_hz
    counts = np.round(20000.0 * np.sin(7.0 * renewed)).astype(int) & 0xFFFF
    block = Block({"angle": Register(address=0, type="int16", scale=1e-4, unit="rad")})
    asked = np.r_[0.0, answered[:-1]]
    answers = [(a, b, [int(n)]) for a, b, n in zip(asked, answered, counts, strict=True)]
    return Series.of_answers(block, answers)


@pytest.mark.parametrize("new_hz", [20.0, 50.0, 80.0])
@pytest.mark.parametrize("late_s", [0.0005, 0.002], ids=["idle", "busy"])
def test_a_device_that_is_slower_than_the_rows_is_named(new_hz, late_s):
    texts = [one.text for one in check_values(PROBE, angles(new_hz, late_s, 1), RATE_HZ)]
    assert any("new values come at" in text for text in texts)


@pytest.mark.parametrize("late_s", [0.0005, 0.002, 0.004], ids=["idle", "busy", "very busy"])
def test_rows_that_a_busy_computer_reads_late_are_no_slow_device(late_s):
    for seed in range(20):
        assert list(check_values(PROBE, angles(RATE_HZ, late_s, seed), RATE_HZ)) == []


@pytest.mark.parametrize("new_hz", [60.0, 80.0])
def test_a_counted_sample_with_the_value_of_the_one_before_is_named(new_hz):
    answered = 0.001 * np.arange(1, 1500)
    samples = np.floor(answered * RATE_HZ + 1e-9).astype(int)
    renewed = np.floor(samples / RATE_HZ * new_hz + 1e-9) / new_hz
    counts = np.round(20000.0 * np.sin(7.0 * renewed)).astype(int) & 0xFFFF
    block = Block(
        {
            "sequence": Register(address=0, type="uint16"),
            "angle": Register(address=1, type="int16", scale=1e-4, unit="rad"),
        }
    )
    answers = [
        (t - 0.001, t, [int(k), int(n)]) for t, k, n in zip(answered, samples, counts, strict=True)
    ]
    series = Series.of_answers(block, answers)
    texts = [one.text for one in check_values(PROBE, series, RATE_HZ)]
    assert any("new values come at" in text for text in texts)
