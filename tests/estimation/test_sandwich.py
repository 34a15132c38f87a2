"""The sandwich of values that are hardly separated is still a covariance."""

import numpy as np
import pytest

from pipelines.estimation.sandwich import sandwich


def test_it_is_the_product_where_values_are_separated():
    rng = np.random.default_rng(1)
    sensitivity, root = rng.normal(size=(3, 4)), rng.normal(size=(4, 4))
    expected = sensitivity @ (root @ root.T) @ sensitivity.T
    assert sandwich(sensitivity, root @ root.T) == pytest.approx(expected)


@pytest.mark.parametrize("seed", range(5))
def test_values_that_are_hardly_separated_have_a_symmetric_covariance(seed):
    """As of a stiff spring beside the inertia that it moves: the product multiplied out is lopsided
    by more than its small variances."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(2000, 8))
    columns[:, 1] = columns[:, 0] + 1e-6 * rng.normal(size=2000)
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-15, hermitian=True)
    filling = (columns * rng.uniform(0.5, 2.0, (2000, 1))).T @ columns
    filling = 0.5 * (filling + filling.T)
    product, covariance = inverse @ filling @ inverse, sandwich(inverse, filling)
    size = np.sqrt(np.abs(np.diag(product)))
    assert np.max(np.abs(product - product.T) / np.outer(size, size)) > 1e-6
    assert (covariance == covariance.T).all() and (np.diag(covariance) > 0.0).all()
