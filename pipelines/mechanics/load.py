"""What a rigid body asks of its joints along a motion, and how that changes where it moves a little otherwise."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanism import Mechanism

STEP = 1e-4
"""rad and rad/s of the difference quotients: the torque bends over tenths of a radian."""


class Load(NamedTuple):
    """Torque of a body along a motion, and its slopes there; n samples, J joints."""

    torque: NDArray
    """(n, J) N·m."""
    inertia: NDArray
    """(n, J, J) N·m per rad/s²: the mass matrix."""
    damping: NDArray
    """(n, J, J) N·m per rad/s: centrifugal and Coriolis torque."""
    stiffness: NDArray
    """(n, J, J) N·m per rad: gravity, and what turns with the body."""

    def along(self, direction: NDArray) -> "Load":
        """Return the load of one coordinate that turns the joints by ``direction`` (n, J): arrays (n,)."""
        turned = np.flatnonzero(direction.any(axis=0))
        slopes = (
            sum(direction[:, i] * slope[:, i, j] * direction[:, j] for i in turned for j in turned)
            for slope in self[1:]
        )
        return Load(np.sum(direction * self.torque, axis=1), *slopes)


@dataclass(frozen=True)
class LoadColumns:
    """A body's load along a motion (n, J), per unit of each of its p inertial parameters.

    Each is computed once. The slopes are many times as large as the motion, so only where something swings.
    """

    mechanism: Mechanism
    q: NDArray
    dq: NDArray
    ddq: NDArray
    geometry: Geometry

    @cached_property
    def torque(self) -> NDArray:
        """The torque itself, (n, J, p)."""
        return self._torque(self.q, self.dq, self.ddq)

    @cached_property
    def slopes(self) -> NDArray:
        """Its slopes with acceleration, velocity and angle, (3, n, J, J, p)."""
        here = self.torque
        n, J, p = here.shape
        slopes = np.empty((3, n, J, J, p))
        for j, unit in enumerate(np.eye(J)):
            slopes[0, :, :, j] = self._torque(self.q, self.dq, self.ddq + unit) - here
            slopes[1, :, :, j] = (self._torque(self.q, self.dq + STEP * unit, self.ddq) - here) / STEP
            slopes[2, :, :, j] = (self._torque(self.q + STEP * unit, self.dq, self.ddq) - here) / STEP
        return slopes

    def of(self, X: NDArray) -> Load:
        """Return the load of a body with inertial parameters ``X`` (p,)."""
        return Load(self.torque @ X, *(self.slopes @ X))

    def _torque(self, q: NDArray, dq: NDArray, ddq: NDArray) -> NDArray:
        return self.mechanism.regressor(q, dq, ddq, self.geometry)
