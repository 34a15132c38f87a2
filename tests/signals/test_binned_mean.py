"""A running mean is the mean of what stands in each bin, and of nothing where there is hardly anything."""

import numpy as np
import pytest

from pipelines.signals.binned_mean import BINS, FEWEST, binned_mean


def test_each_bin_has_the_mean_of_its_own_values_both_ends_included():
    rng = np.random.default_rng(0)
    x = np.concatenate([[0.0, 1.0], rng.uniform(0, 1, 4000)])
    y = rng.standard_normal(len(x))
    middles, means = binned_mean(x, y, 0.0, 1.0)
    for k, middle in enumerate(middles):
        near = np.abs(x - middle) <= 0.5 / BINS
        assert means[k] == pytest.approx(y[near].mean(), abs=1e-12)


def test_a_bin_of_too_few_has_no_mean_and_what_lies_outside_counts_nowhere():
    x = np.concatenate([np.full(FEWEST, 0.5 / BINS), np.full(FEWEST - 1, 1.5 / BINS), [-1.0, 2.0]])
    _, means = binned_mean(x, np.ones(len(x)), 0.0, 1.0)
    assert means[0] == 1.0
    assert np.isnan(means[1:]).all()
