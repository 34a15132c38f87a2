"""Which readings of a clock keep time with this computer."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.acquisition.check.clock import _keeps_time as keeps_time
from pipelines.acquisition.check.clock import check_clock, measure_clock
from pipelines.acquisition.check.probe import Series
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register

SECONDS = np.arange(0.0, 1.0, 0.005)
EVEN = np.arange(0.0, 2.0, 0.002)
"""Instants of answers, s."""
IN_BURSTS = np.sort([start + k / 4e3 for start in np.arange(0.0, 2.0, 0.032) for k in range(5)])
"""Five answers in a millisecond, then none for 31 ms: up to two samples of 50 Hz come meanwhile."""


@pytest.mark.parametrize("missing", [0.0, 0.005, -0.005])
def test_a_clock_may_be_a_sample_short_or_long(missing):
    assert keeps_time(SECONDS, SECONDS[-1] + missing)


@pytest.mark.parametrize("leap", [0.1, 10.0, 1000.0])
def test_a_leap_does_not_allow_itself(leap):
    leapt = SECONDS + leap * (SECONDS > 0.5)
    assert not keeps_time(leapt, SECONDS[-1])


@pytest.mark.parametrize("ticks_hz", [1000.0, 1024.0])
def test_a_clock_in_another_tick_keeps_no_time(ticks_hz):
    """Ticks of 1/1024 s pass for milliseconds."""
    seconds = np.arange(0.0, 2.0, 0.005)
    assert keeps_time(1e-3 * ticks_hz * seconds, seconds[-1]) == (ticks_hz == 1000.0)


def test_a_clock_that_stands_still_or_goes_back_keeps_no_time():
    assert not keeps_time(np.zeros(200), 1.0)
    assert not keeps_time(SECONDS[::-1], 1.0)


@pytest.mark.parametrize(
    ("answered", "step", "is_named"),
    [
        (EVEN, 2, True),
        (EVEN, 1, False),
        (IN_BURSTS, 1, False),
    ],
    ids=["counts in steps of two", "counts", "answers late now and then"],
)
def test_only_steps_that_a_device_makes_itself_are_named(answered, step, is_named):
    rate_hz = 50.0
    block = Block({"sequence": Register(address=0, type="uint16")})
    counts = (answered * rate_hz / step).astype(int) * step
    asked = np.r_[0.0, answered[:-1]]
    answers = [(a, b, [int(n)]) for a, b, n in zip(asked, answered, counts, strict=True)]
    series = Series.of_answers(block, answers)
    probe = SimpleNamespace(
        map_path="map.drive.servo", in_lockstep=False, finding=lambda text, name: text
    )
    clock = measure_clock(probe, series, 2.0)
    findings = list(check_clock(probe, series, clock, 2.0, rate_hz))
    assert len(findings) == int(is_named)
    assert all("goes up by 2 at a time" in text for text in findings)
