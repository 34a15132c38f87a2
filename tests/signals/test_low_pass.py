import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import butter, sosfiltfilt

from pipelines.signals.low_pass import derivative, low_pass

RATE_HZ = 200.0
TIME = np.arange(0, 20, 1 / RATE_HZ)


@pytest.mark.parametrize("hz", [0.1, 0.5, 1.0, 3.0])
def test_a_slow_sine_passes_without_delay_or_loss(hz):
    x = np.sin(2 * np.pi * hz * TIME)
    inside = slice(200, -200)
    assert_allclose(low_pass(x, RATE_HZ, 12.0)[inside], x[inside], atol=1e-4)


def test_the_cutoff_is_where_two_passes_leave_half_the_amplitude():
    x = np.sin(2 * np.pi * 12.0 * TIME)
    assert np.ptp(low_pass(x, RATE_HZ, 12.0)[1000:-1000]) / 2 == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_of_a_sine_are_those_of_calculus(order):
    w = 2 * np.pi * 1.0
    exact = w * np.cos(w * TIME) if order == 1 else -(w**2) * np.sin(w * TIME)
    assert_allclose(
        derivative(np.sin(w * TIME), RATE_HZ, order)[5:-5],
        exact[5:-5],
        rtol=0,
        atol=1e-5 * w**order,
    )


def test_derivatives_of_a_parabola_are_exact_to_the_very_edge():
    x = 3 + 2 * TIME + 0.5 * TIME**2
    assert_allclose(derivative(x, RATE_HZ, 1), 2 + TIME, atol=1e-9)
    assert_allclose(derivative(x, RATE_HZ, 2), np.ones_like(TIME), atol=1e-6)


@pytest.mark.parametrize(("shape", "order", "padding"), [((300,), 2, 48), ((40, 2, 3), 5, 39)])
def test_it_is_scipys_filter_to_the_last_bit(shape, order, padding):
    x = np.random.default_rng(2).normal(size=shape)
    sections = butter(order, 12.5, fs=200.0, output="sos")
    expected = sosfiltfilt(sections, x, axis=0, padlen=padding)
    assert_array_equal(low_pass(x, 200.0, 12.5, order), expected)
