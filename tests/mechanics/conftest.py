"""The leg as the paper draws it (Figure 1, Table 1): two rigid segments, and their energies (eq. 1
to 4)."""

from dataclasses import dataclass

import numpy as np
import pytest

from pipelines.mechanics.geometry import Geometry

GEOMETRY = Geometry()
STEP = 1e-5
"""Of central differences; their error is near 1e-8."""


@dataclass(frozen=True)
class Segments:
    """Masses (kg), centres (m), inertias about them (kg·m²) of thigh and shank."""

    m1: float = 8.0
    c1: float = 0.17
    I1: float = 0.15
    m2: float = 4.0
    c2: float = 0.22
    I2: float = 0.07

    @property
    def X(self):
        """The paper's X1..X4, appendix A, X1 mended."""
        L1 = GEOMETRY.thigh_length_m
        shank = self.m2 * self.c2**2 + self.I2
        return np.array(
            [
                self.m1 * self.c1**2 + self.I1 + self.m2 * L1**2 + shank,
                shank,
                self.m2 * self.c2,
                self.m1 * self.c1 + self.m2 * L1,
            ]
        )

    def kinetic(self, q, dq):
        """Eq. 1 and 2 from the velocities of the two centres, J."""
        L1 = GEOMETRY.thigh_length_m
        whole = q[0] + q[1]
        shank = np.array([L1 * np.cos(q[0]), L1 * np.sin(q[0])]) * dq[0]
        shank += np.array([self.c2 * np.cos(whole), self.c2 * np.sin(whole)]) * (dq[0] + dq[1])
        spin = (
            self.m1 * self.c1**2 * dq[0] ** 2
            + self.I1 * dq[0] ** 2
            + self.I2 * (dq[0] + dq[1]) ** 2
        )
        return 0.5 * spin + 0.5 * self.m2 * shank @ shank

    def potential(self, q):
        """Eq. 3 and 4, J."""
        g, L1 = GEOMETRY.gravity_m_s2, GEOMETRY.thigh_length_m
        thigh = -self.c1 * self.m1 * g * np.cos(q[0])
        return thigh - self.m2 * g * (L1 * np.cos(q[0]) + self.c2 * np.cos(q[0] + q[1]))

    def lagrangian(self, q, dq):
        """Eq. 5, J."""
        return self.kinetic(q, dq) - self.potential(q)

    def momentum(self, q, dq):
        """dL/d(dq), (2,)."""
        return gradient(lambda v: self.lagrangian(q, v), dq)

    def force(self, q, dq):
        """dL/dq, (2,)."""
        return gradient(lambda x: self.lagrangian(x, dq), q)

    def torque(self, q, dq, ddq):
        """Eq. 6 with the total derivative of time, (2,) N·m."""
        ahead = self.momentum(q + STEP * dq, dq + STEP * ddq)
        behind = self.momentum(q - STEP * dq, dq - STEP * ddq)
        return (ahead - behind) / (2 * STEP) - self.force(q, dq)


def gradient(function, x, step=1e-4):
    """Central differences of a scalar function, (2,)."""
    return np.array(
        [
            (function(x + step * unit) - function(x - step * unit)) / (2 * step)
            for unit in np.eye(len(x))
        ]
    )


@pytest.fixture
def segments() -> Segments:
    return Segments()


@pytest.fixture
def states():
    """Fifty states (q, dq, ddq) of the leg, (50, 3, 2)."""
    return np.random.default_rng(1).uniform(-1.5, 1.5, (50, 3, 2))
