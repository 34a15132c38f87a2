"""Local refinement by an evolution strategy that learns the cost's covariance (CMA-ES).

Source: Hansen (2016), "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772, with its names.
It needs no gradient: shrinking to the bounds, sgn columns and crossing eigenvalues all make kinks
in the criterion.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray


def polish(
    start: NDArray,
    spread: NDArray,
    costs: Callable[[NDArray], NDArray],
    rng: np.random.Generator,
    out_of_time: Callable[[], bool],
    patience: int = 60,
    least_gain: float = 1e-6,
) -> tuple[NDArray, float]:
    """Minimize from ``start`` until the cost stagnates.

    Parameters
    ----------
    start : (D,) array
        First mean.
    spread : (D,) array
        Standard deviation of the first candidates.
    costs : callable
        Returns the costs (P,) of candidates (P, D), and may repair them in place.
    rng : Generator
        Random numbers.
    out_of_time : callable
        Returns whether to stop.
    patience : int, optional
        Generations without a gain after which the cost stagnates.
    least_gain : float, optional
        Smallest relative gain that counts.

    Returns
    -------
    best : (D,) array
        The best candidate, repaired.
    cost : float
        Its cost.
    """
    population, generations = 24, 2000
    # The decomposition costs as much as several candidates, and the covariance changes slowly.
    generations_per_decomposition = 5
    size = len(start)
    # Default weights and constants of the tutorial, for a given population.
    rank = np.arange(1, population // 2 + 1)
    weights = np.log(population / 2 + 0.5) - np.log(rank)
    weights /= weights.sum()
    mu = 1.0 / np.sum(weights**2)
    c_c = (4 + mu / size) / (size + 4 + 2 * mu / size)
    c_sigma = (mu + 2) / (size + mu + 5)
    c_1 = 2 / ((size + 1.3) ** 2 + mu)
    c_mu = min(1 - c_1, 2 * (mu - 2 + 1 / mu) / ((size + 2) ** 2 + mu))
    damping = 1 + 2 * max(0.0, np.sqrt((mu - 1) / (size + 1)) - 1) + c_sigma
    expected_length = np.sqrt(size) * (1 - 1 / (4 * size) + 1 / (21 * size**2))

    mean, sigma, covariance = start.copy(), 1.0, np.diag(spread**2)
    path_c, path_sigma = np.zeros(size), np.zeros(size)
    best, best_cost, last_gain = start.copy(), np.inf, 0
    for generation in range(generations):
        if generation % generations_per_decomposition == 0:
            eigenvalues, axes = np.linalg.eigh(covariance)
            # Rounding may make the least eigenvalue negative.
            lengths = np.sqrt(np.maximum(eigenvalues, 1e-20))
        steps = (rng.standard_normal((population, size)) * lengths) @ axes.T
        candidates = mean + sigma * steps
        # A repair changes candidates, but not the steps from which mean and covariance learn.
        cost = costs(candidates)
        order = np.argsort(cost)
        # The right side is NaN while best_cost is infinite, and then any cost is a gain.
        if not cost[order[0]] >= best_cost - least_gain * abs(best_cost):
            last_gain = generation
        if cost[order[0]] < best_cost:
            best, best_cost = candidates[order[0]].copy(), float(cost[order[0]])
        if generation - last_gain > patience or out_of_time():
            break
        chosen = steps[order[: len(weights)]]
        step = weights @ chosen
        mean = mean + sigma * step
        # C^(-1/2) times the step. Its path is longer than expected if steps agree in direction.
        whitened = axes @ ((axes.T @ step) / lengths)
        path_sigma = (1 - c_sigma) * path_sigma + np.sqrt(c_sigma * (2 - c_sigma) * mu) * whitened
        length = np.linalg.norm(path_sigma) / expected_length
        # After a long path sigma grows. Then path_c pauses, or the covariance would grow as well.
        steady = length < (1.4 + 2 / (size + 1)) * np.sqrt(
            1 - (1 - c_sigma) ** (2 * (generation + 1))
        )
        path_c = (1 - c_c) * path_c + steady * np.sqrt(c_c * (2 - c_c) * mu) * step
        covariance = (1 - c_1 - c_mu) * covariance + c_1 * np.outer(path_c, path_c)
        # Rank-mu update: the weighted scatter of the better half.
        covariance += c_mu * (chosen.T * weights) @ chosen
        sigma *= np.exp(min(1.0, c_sigma / damping * (length - 1)))
    return best, best_cost
