"""Interpolation between samples of a channel that lost some of them."""

import numpy as np

from pipelines.signals.sampling import between_samples


def test_a_gap_is_not_bridged_but_the_samples_at_its_edges_are_kept():
    time = np.delete(0.01 * np.arange(102), np.arange(80, 101))  # the last step is a gap
    at = np.array([-0.001, 0.0, 0.125, time[-2], 0.9, time[-1], 1.02])

    values = between_samples(time, 3.0 * time, at)

    np.testing.assert_allclose(values, 3.0 * np.where([1, 0, 0, 0, 1, 0, 1], np.nan, at))
