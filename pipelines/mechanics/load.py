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


class Along(NamedTuple):
    """Torque of a body on one coordinate along a motion, and its slopes there, (n,) each."""

    torque: NDArray
    """N·m."""
    inertia: NDArray
    """N·m per rad/s²."""
    damping: NDArray
    """N·m per rad/s: centrifugal and Coriolis torque."""
    stiffness: NDArray
    """N·m per rad: gravity, and what turns with the body."""


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

    def torque_of(self, X: NDArray) -> NDArray:
        """Return the torque of a body with inertial parameters ``X`` (p,), (n, J)."""
        flat = self.torque.reshape(-1, len(X))  # numpy multiplies a matrix twenty times as fast as a stack of them
        return (flat @ X).reshape(self.q.shape)

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

    def along(self, direction: NDArray) -> NDArray:
        """Return load and slopes, (4, n, p), of one coordinate that turns the joints by ``direction`` (n, J)."""
        key = direction.tobytes()
        if key not in self._along:
            turned = np.flatnonzero(direction.any(axis=0))
            parts = [sum(direction[:, i, np.newaxis] * self.torque[:, i] for i in turned)]
            parts += [
                sum((direction[:, i] * direction[:, j])[:, np.newaxis] * slope[:, i, j] for i in turned for j in turned)
                for slope in self.slopes
            ]
            self._along[key] = np.array(parts)
        return self._along[key]

    @cached_property
    def _along(self) -> dict[bytes, NDArray]:
        """What was computed, by direction: a fit asks for few directions thousands of times."""
        return {}

    def _torque(self, q: NDArray, dq: NDArray, ddq: NDArray) -> NDArray:
        return self.mechanism.regressor(q, dq, ddq, self.geometry)


@dataclass(frozen=True)
class Load:
    """The load of a rigid body along a motion."""

    columns: LoadColumns
    X: NDArray
    """(p,) inertial parameters."""

    def along(self, direction: NDArray) -> Along:
        """Return the load of one coordinate that turns the joints by ``direction`` (n, J)."""
        return Along(*(self.columns.along(direction) @ self.X))
