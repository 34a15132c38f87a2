"""Temperatures of the motors: they warm while a leg moves and cool between runs."""

from collections.abc import Mapping

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

RATE_HZ = 50.0


class Warmth:
    """How warm both motors are in each run of a session, in the order in which the runs were
    made."""

    def __init__(self, rng: Generator, runs: int) -> None:
        self.room = rng.uniform(18.0, 27.0)
        self.final = self.room + rng.uniform(8.0, 35.0, 2)
        self.time = rng.uniform(60.0, 400.0, 2)
        cold = rng.uniform(0.0, 0.2, 2)
        steps = rng.dirichlet(np.full(runs, 2.0)) * rng.uniform(0.5, 0.9)
        self.share = cold[:, None] + (1.0 - cold[:, None]) * np.concatenate(
            [[0.0], np.cumsum(steps)[:-1]]
        )
        self.order = rng.permutation(runs)

    def curve(self, run: int, duration_s: float) -> NDArray:
        """Return both temperatures at 50 Hz, (n, 2) degrees Celsius."""
        t = np.arange(round(duration_s * RATE_HZ) + 3) / RATE_HZ
        begin = self.share[:, self.order[run]]
        share = 1.0 - (1.0 - begin) * np.exp(-t[:, None] / self.time)
        return self.room + (self.final - self.room) * share

    def range(self, durations_s: Mapping[int, float]) -> NDArray:
        """Return coldest and warmest of both motors, (2, 2), over runs of these lengths."""
        curves = np.concatenate([self.curve(run, length) for run, length in durations_s.items()])
        return np.array([curves.min(axis=0), curves.max(axis=0)])
