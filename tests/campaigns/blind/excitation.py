"""Excitations: periodic multi-sines within the paper's Table 2, the most informative of a few
random ones."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

PERIOD_S = 10.0
LOWEST = np.array([0.0872, -1.6232])
HIGHEST = np.array([1.2217, -0.2269])
FASTEST = 1.6449
STEEPEST = 5.1677
MARGIN = 0.96
"""Share of the bounds that is used: the leg does not follow to the letter."""


@dataclass(frozen=True)
class Excitation:
    """theta = theta0 + sum a_k sin(k w t) + b_k cos(k w t); rows are hip and knee."""

    theta0: NDArray
    a: NDArray
    b: NDArray

    def at(self, t: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Angle, velocity, acceleration, each (n, 2)."""
        w = 2 * np.pi / PERIOD_S * np.arange(1, self.a.shape[1] + 1)
        s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        q = self.theta0 + s @ self.a.T + c @ self.b.T
        dq = (c * w) @ self.a.T - (s * w) @ self.b.T
        ddq = -(s * w**2) @ self.a.T - (c * w**2) @ self.b.T
        return q, dq, ddq


def random_excitation(rng: Generator, tries: int = 60) -> Excitation:
    """Draw feasible excitations of one number of harmonics and return the one with the largest
    determinant."""
    harmonics = int(rng.integers(3, 6))
    drawn = [_feasible(rng, harmonics) for _ in range(tries)]
    return max(drawn, key=_information)


def _feasible(rng: Generator, harmonics: int) -> Excitation:
    middle, half = (LOWEST + HIGHEST) / 2, (HIGHEST - LOWEST) / 2
    theta0 = middle + rng.uniform(-0.3, 0.3, 2) * half
    a, b = rng.normal(size=(2, 2, harmonics)) / np.sqrt(np.arange(1, harmonics + 1))
    t = np.arange(0.0, PERIOD_S, 0.02)
    q, dq, ddq = Excitation(np.zeros(2), a, b).at(t)
    room = np.minimum((HIGHEST - theta0) / q.max(axis=0), (LOWEST - theta0) / q.min(axis=0))
    scale = MARGIN * np.min(
        [room, FASTEST / np.abs(dq).max(axis=0), STEEPEST / np.abs(ddq).max(axis=0)], axis=0
    )
    return Excitation(theta0, a * scale[:, np.newaxis], b * scale[:, np.newaxis])


def _information(excitation: Excitation) -> float:
    q, dq, ddq = excitation.at(np.arange(0.0, PERIOD_S, 0.05))
    columns = baseline_columns(q, dq, ddq, 0.4, 9.81).reshape(-1, 8)
    return float(np.linalg.slogdet(columns.T @ columns)[1])


def baseline_columns(
    q: NDArray, dq: NDArray, ddq: NDArray, length: float, gravity: float
) -> NDArray:
    """Torque per unit of X1..X4 and of each joint's Coulomb and viscous friction, (n, 2, 8)."""
    absolute = q.sum(axis=1)
    bend, fold = np.cos(q[:, 1]), np.sin(q[:, 1])
    Y = np.zeros((len(q), 2, 8))
    Y[:, 0, 0] = ddq[:, 0]
    Y[:, 0, 1] = ddq[:, 1]
    Y[:, 1, 1] = ddq.sum(axis=1)
    centrifugal = (2 * dq[:, 0] + dq[:, 1]) * dq[:, 1]
    Y[:, 0, 2] = length * (
        bend * (2 * ddq[:, 0] + ddq[:, 1]) - fold * centrifugal
    ) + gravity * np.sin(absolute)
    Y[:, 1, 2] = length * (bend * ddq[:, 0] + fold * dq[:, 0] ** 2) + gravity * np.sin(absolute)
    Y[:, 0, 3] = gravity * np.sin(q[:, 0])
    for j in range(2):
        Y[:, j, 4 + j] = np.sign(dq[:, j])
        Y[:, j, 6 + j] = dq[:, j]
    return Y
