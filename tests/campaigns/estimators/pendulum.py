"""Many sessions of a pendulum that shares no code with exoid, spoilt in several ways."""

import time
from collections.abc import Iterator, Sequence

import numpy as np

from pipelines.estimation.estimator import Estimator, estimated
from tests.campaigns.estimators.markdown import show as table
from tests.estimation.pendulum import TRUTH, Disturbed, motion, problem

SPOILT = {
    "torque noise, 20 ms correlated": Disturbed(),
    "torque noise, 0.2 s correlated": Disturbed(correlation_s=0.2),
    "and angle noise of 2 mrad": Disturbed(angle_rad=0.002),
    "and 2 % of the torques struck": Disturbed(outliers=0.02),
}
NAMES = ("inertia", "moment", "Coulomb", "viscous")


def show(methods: Sequence[Estimator], sessions: int) -> None:
    """Print a table for each way."""
    for name, disturbed in SPOILT.items():
        headings = ("method", *(f"{n}, bias % ± scatter" for n in NAMES), "covered", "s")
        table(
            f"**{name}**, {sessions} sessions of 20 s",
            headings,
            _rows(methods, disturbed, sessions),
        )


def _rows(
    methods: Sequence[Estimator], disturbed: Disturbed, sessions: int
) -> Iterator[tuple[str, ...]]:
    problems = [problem(motion(disturbed, seed)) for seed in range(1000, 1000 + sessions)]
    for estimator in methods:
        begun, values, inside = time.process_time(), [], []
        for one in problems:
            found = estimated(estimator.fit(one))
            values.append(found.values / TRUTH)
            inside.append(
                np.abs(found.values - TRUTH) <= found.critical * np.sqrt(np.diag(found.covariance))
            )
        bias, scatter = 100.0 * (np.mean(values, axis=0) - 1.0), 100.0 * np.std(values, axis=0)
        seconds = (time.process_time() - begun) / sessions
        yield (
            estimator.name,
            *(f"{b:+.1f} ± {s:.1f}" for b, s in zip(bias, scatter, strict=True)),
            f"{100.0 * np.mean(inside):.0f} %",
            f"{seconds:.2g}",
        )
