"""What a channel was between its readings."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pipelines.signals.interpolation import between_readings

TIME = np.arange(0.0, 10.0, 0.005)
WAVE = np.column_stack([np.sin(2.0 * np.pi * TIME), np.cos(2.0 * np.pi * TIME)])


def read_every(samples, first=1):
    x = np.full_like(WAVE, np.nan)
    x[first::samples] = WAVE[first::samples]
    return x


@pytest.mark.parametrize(("samples", "error"), [(4, 3e-4), (20, 2e-2)])
def test_a_wave_is_what_it_was_between_readings(samples, error):
    inside = slice(samples, -samples)
    assert np.abs(between_readings(read_every(samples), samples) - WAVE)[inside].max() < error


def test_readings_themselves_are_left_alone():
    x = read_every(4)
    assert_array_equal(between_readings(x, 20)[1::4], x[1::4])
    assert between_readings(WAVE, 20) is WAVE


def test_nothing_is_interpolated_across_long_intervals_or_beyond_the_readings():
    x = read_every(4)
    x[1000:1021] = np.nan
    made = between_readings(x, 20)
    assert np.isnan(made[998:1021]).all()
    assert np.isfinite(made[1:998]).all()
    assert np.isfinite(made[1021:-3]).all()
    assert np.isnan(made[:1]).all()


def test_a_channel_that_stands_still_does_so_between_its_readings_too():
    x = np.full((100, 1), np.nan)
    x[::4] = 3.7
    assert np.ptp(between_readings(x, 20)[:97]) == 0.0


def test_one_reading_is_not_extrapolated():
    x = np.full((100, 1), np.nan)
    x[50] = 1.0
    assert_array_equal(between_readings(x, 20), x)
