"""What a rigid body asks of its joints along a motion, and how that changes where it moves a little otherwise."""

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


class LoadColumns(NamedTuple):
    """A load per unit of each inertial parameter of a body, p of them."""

    torque: NDArray
    """(n, J, p)."""
    inertia: NDArray
    """(n, J, J, p)."""
    damping: NDArray
    """(n, J, J, p)."""
    stiffness: NDArray
    """(n, J, J, p)."""

    def of(self, X: NDArray) -> Load:
        """Return the load of a body with inertial parameters ``X`` (p,)."""
        return Load(*(columns @ X for columns in self))


def load_columns(mechanism: Mechanism, q: NDArray, dq: NDArray, ddq: NDArray, geometry: Geometry) -> LoadColumns:
    """Return what each inertial parameter adds to a body's load along a motion (n, J)."""
    J = q.shape[1]

    def torque(q: NDArray, dq: NDArray, ddq: NDArray) -> NDArray:
        return mechanism.regressor(q, dq, ddq, geometry)

    here = torque(q, dq, ddq)
    slopes = np.empty((3, *here.shape[:2], J, here.shape[2]))
    for j, unit in enumerate(np.eye(J)):
        slopes[0, :, :, j] = torque(q, dq, ddq + unit) - here
        slopes[1, :, :, j] = (torque(q, dq + STEP * unit, ddq) - here) / STEP
        slopes[2, :, :, j] = (torque(q + STEP * unit, dq, ddq) - here) / STEP
    return LoadColumns(here, *slopes)
