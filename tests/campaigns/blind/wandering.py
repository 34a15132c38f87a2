"""Smooth random curves: what drifts without a rule."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

RATE_HZ = 50.0


def random_curve(rng: Generator, duration_s: float, smoothing_s: float) -> NDArray:
    """Return a random walk from zero, smoothed, with unit rms, at 50 Hz."""
    steps = rng.standard_normal(int(duration_s * RATE_HZ) + 2)
    walk = gaussian_filter1d(np.cumsum(steps), smoothing_s * RATE_HZ, mode="nearest")
    walk -= walk[0]
    return walk / np.sqrt(np.mean(walk**2))


def random_walk(
    rng: Generator, duration_s: float, smoothing_s: float
) -> Callable[[NDArray], NDArray]:
    """Return ``random_curve`` as a function of time."""
    curve = random_curve(rng, duration_s, smoothing_s)
    return lambda t: np.interp(t, np.arange(len(curve)) / RATE_HZ, curve)
