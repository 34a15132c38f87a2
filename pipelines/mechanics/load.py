"""The load of a rigid body on its joints along a motion, and its slopes near that motion."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanism import Mechanism


@dataclass(frozen=True)
class LoadColumns:
    """A body's load along a motion (n, J), per unit of each of its p inertial parameters.

    Each column is computed once.
    """

    mechanism: Mechanism
    q: NDArray
    dq: NDArray
    ddq: NDArray
    geometry: Geometry
    # Results by direction: thousands of fits need few directions.
    _projected: dict[bytes, NDArray] = field(default_factory=dict, init=False)

    @cached_property
    def torque(self) -> NDArray:
        """Torque per unit of each parameter, (n, J, p)."""
        return self._torque(self.q, self.dq, self.ddq)

    def projected(self, direction: NDArray) -> NDArray:
        """Return torque and slopes on one coordinate.

        Parameters
        ----------
        direction : (n, J) array
            Rotation of the joints per unit of the coordinate.

        Returns
        -------
        (4, n, p) array
            Per unit of each parameter: torque, N·m; inertia, N·m per rad/s²; damping, N·m per
            rad/s, of centrifugal and Coriolis torque; stiffness, N·m per rad, of gravity, and of
            torques that turn with the body.
        """
        # Arrays are not hashable. Equal directions have equal bytes.
        key = direction.tobytes()
        if key not in self._projected:
            # Of the difference quotients, rad and rad/s: the torque bends over tenths of a radian.
            size = 1e-4
            step = size * direction
            # Torque is linear in acceleration, so that a whole unit gives the exact slope there.
            torques = (
                self.torque,
                self._torque(self.q, self.dq, self.ddq + direction) - self.torque,
                (self._torque(self.q, self.dq + step, self.ddq) - self.torque) / size,
                (self._torque(self.q + step, self.dq, self.ddq) - self.torque) / size,
            )
            # Virtual work: the torque on a coordinate is the joints' torque along its direction.
            self._projected[key] = np.array(
                [np.einsum("nj,njp->np", direction, torque) for torque in torques]
            )
        return self._projected[key]

    def _torque(self, q: NDArray, dq: NDArray, ddq: NDArray) -> NDArray:
        return self.mechanism.regressor(q, dq, ddq, self.geometry)
