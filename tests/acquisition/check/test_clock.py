"""Which readings of a clock keep time with this computer."""

import numpy as np
import pytest

from pipelines.acquisition.check.clock import _keeps_time as keeps_time

SECONDS = np.arange(0.0, 1.0, 0.005)


@pytest.mark.parametrize("missing", [0.0, 0.005, -0.005])
def test_a_clock_may_be_a_sample_short_or_long(missing):
    assert keeps_time(SECONDS, SECONDS[-1] + missing)


@pytest.mark.parametrize("leap", [0.1, 10.0, 1000.0])
def test_a_leap_does_not_allow_itself(leap):
    leapt = SECONDS + leap * (SECONDS > 0.5)
    assert not keeps_time(leapt, SECONDS[-1])


def test_a_clock_that_stands_still_or_goes_back_keeps_no_time():
    assert not keeps_time(np.zeros(200), 1.0)
    assert not keeps_time(SECONDS[::-1], 1.0)
