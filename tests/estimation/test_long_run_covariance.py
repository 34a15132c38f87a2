import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.estimation import long_run


def long_run_covariance(stretches, parameters):
    return long_run.long_run_covariance(lambda: enumerate(stretches), parameters)


def summed_lag_by_lag(stretches, lag):
    """The sum as Newey and West write it."""
    S = sum(x.T @ x for x in stretches)
    for k in range(1, lag + 1):
        for x in stretches:
            product = x[k:].T @ x[:-k] if len(x) > k else np.zeros_like(S)
            S = S + (1.0 - k / (lag + 1)) * (product + product.T)
    return S


@pytest.mark.parametrize("piece", [1, 3, 40, 1000])
@pytest.mark.parametrize("lag", [0, 1, 7, 60])
def test_running_sums_are_the_sum_lag_by_lag_whatever_the_pieces(lag, piece):
    rng = np.random.default_rng(5)
    stretches = [
        lfilter([1], [1, -0.8], rng.standard_normal((n, 3)), axis=0) for n in (200, 1, 30, 500)
    ]

    def in_pieces():
        for name, x in enumerate(stretches):
            for start in range(0, len(x), piece):
                yield name, x[start : start + piece]

    expected = summed_lag_by_lag(stretches, lag)
    np.testing.assert_allclose(
        long_run._bartlett(in_pieces, lag), expected, rtol=0, atol=1e-11 * np.abs(expected).max()
    )
    whole = long_run.long_run_covariance(lambda: enumerate(stretches), 3)
    split = long_run.long_run_covariance(in_pieces, 3)
    np.testing.assert_allclose(split[0], whole[0], rtol=1e-9)
    assert split[1] == whole[1]


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_the_variance_of_a_sum_of_correlated_numbers_is_met(rho):
    """A first-order process of unit variance: the sum of n has variance n (1 + rho) / (1 - rho)."""
    rng = np.random.default_rng(7)
    n = 2000
    found = []
    for _ in range(60):
        noise = lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal(n + 200))[
            200:, np.newaxis
        ]
        found.append(long_run_covariance([noise], 1)[0].item())
    assert np.mean(found) == pytest.approx(n * (1 + rho) / (1 - rho), rel=0.12)


def test_a_gap_is_not_bridged():
    """Two segments count as two: nothing is multiplied across the gap between them."""
    rng = np.random.default_rng(1)
    noise = lfilter([1], [1, -0.9], rng.standard_normal(4000))[:, np.newaxis]
    whole, *_ = long_run_covariance([noise], 1)
    halves, *_ = long_run_covariance([noise[:2000], noise[2000:]], 1)
    assert halves.item() != whole.item()
    assert halves.item() == pytest.approx(whole.item(), rel=0.1)


def test_the_critical_value_grows_with_the_share_of_the_lag():
    rng = np.random.default_rng(1)
    slow = lfilter([1], [1, -0.95], rng.standard_normal(400))[:, np.newaxis]
    assert (
        long_run_covariance([slow], 1)[1]
        > long_run_covariance([rng.standard_normal((400, 1))], 1)[1]
        >= 1.96
    )


def test_a_parameter_in_another_unit_changes_no_lag():
    """One slow score among fast ones: in rad or in degrees, the covariance is the same thing in
    other units."""
    rng = np.random.default_rng(3)
    fast, slow = (lfilter([1], [1, -rho], rng.standard_normal(4000)) for rho in (0.1, 0.95))
    scores, scale = np.column_stack([fast, slow]), np.array([100.0, 0.01])
    covariance, critical, _ = long_run_covariance([scores], 2)
    scaled, scaled_critical, _ = long_run_covariance([scores * scale], 2)
    assert scaled_critical == critical
    np.testing.assert_allclose(scaled, covariance * np.outer(scale, scale), rtol=1e-10)
