"""A running mean is the mean of what stands in each bin, and of nothing where there is hardly
anything."""

import numpy as np
import pytest

from pipelines.signals.binned_mean import FEWEST, binned_mean


def test_each_bin_has_the_mean_of_its_own_values_both_ends_included():
    rng = np.random.default_rng(0)
    x = np.concatenate([[0.0, 1.0], rng.uniform(0, 1, 4000)])
    y = rng.standard_normal(len(x))
    places, means = binned_mean(x, y, 0.0, 1.0, bins=40)
    assert len(places) == 40
    for k in range(40):
        near = np.abs(x - (k + 0.5) / 40) <= 0.5 / 40
        assert (places[k], means[k]) == pytest.approx((x[near].mean(), y[near].mean()), abs=1e-12)


def test_bins_of_too_few_are_joined_and_what_lies_outside_counts_nowhere():
    rng = np.random.default_rng(1)
    x = np.concatenate(
        [rng.uniform(0.0, 0.1, 5 * FEWEST), rng.uniform(0.5, 1.0, FEWEST + 3), [-1.0, 2.0]]
    )
    places, means = binned_mean(x, 2.0 * x, 0.0, 1.0, bins=40)
    assert 2 <= len(places) < 40
    assert np.all(np.diff(places) > 0)
    np.testing.assert_allclose(means, 2.0 * places)
    inside = (x >= 0) & (x <= 1)
    assert places.min() >= x[inside].min() and places.max() <= 1.0
    few = binned_mean(x[: FEWEST - 1], x[: FEWEST - 1], 0.0, 1.0)
    assert [len(part) for part in few] == [0, 0]
