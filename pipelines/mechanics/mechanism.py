"""A mechanism: which joints there are, and the torque that its rigid bodies ask of them.

Each mechanism is one file that states its regressor, torque = A(q, dq, ddq) X; mass matrix,
Coriolis matrix and gravity are read off that here, once for all.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import Kind
from pipelines.mechanics.geometry import Geometry


class Inertial(NamedTuple):
    """One inertial parameter."""

    name: str
    unit: str
    meaning: str
    typical: tuple[float, float]
    """The range seen on exoskeletons, or on what a bench holds."""


@dataclass(frozen=True)
class Mechanism:
    """Joints of given kinds and the rigid bodies between them: J joints, p inertial parameters."""

    name: str
    """As exoid.toml has it, ``leg``; what differs by kind of joint or gravity shares it."""
    title: str
    """What joints it has, and after a colon, if need be, what machines it stands for."""
    kinds: tuple[Kind, ...]
    """Of its joints, from the base on."""
    places: tuple[str, ...]
    """What effects call its joints, whatever their names are: ``hip``, ``knee``; ``joint``."""
    has_gravity: bool | None
    """Whether it is the one to take where gravity acts; None where it is the same with and
    without."""
    parameters: tuple[Inertial, ...]
    along: Callable[[NDArray, NDArray, NDArray, NDArray], NDArray]
    """Compiled: q, dq, ddq, each (n, J), and the geometry's array to the regressor, (n, J, p)."""
    bends_at: tuple[str, ...]
    """Places of the joints whose positions its torque depends on; none where it is of acceleration
    alone."""
    reactions: Mapping[str, Any] = field(hash=False, compare=False)
    """Compiled equations of effects that differ from mechanism to mechanism, by the effect's name,
    ``rigid_body`` among them; an effect that is not listed cannot be there."""
    broken: Callable[[NDArray, Geometry], list[str]] = field(hash=False, compare=False)
    """Say which conditions of a real machine the parameters X break; empty when none."""
    inertia_forms: Callable[[Geometry], NDArray] = field(hash=False, compare=False)
    """Symmetric B, (p, m, m): M(q) > 0 at every q if and only if the sum of X_i B_i is, the same
    conditions as a convex program wants them."""
    absorbs: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    """Effects that its own parameters take up whole, by name, and which parameters those are."""
    has_length: bool = False
    """Whether the distance between the first two axes, ``thigh_length_m``, is in its equations."""

    @property
    def joints_in_words(self) -> str:
        """What joints it has, as messages name it."""
        return self.title.partition(":")[0]

    def regressor(self, q: NDArray, dq: NDArray, ddq: NDArray, geometry: Geometry) -> NDArray:
        """Return A along a motion, (n, J, p): torque (N·m, at a prismatic joint N) per unit of each
        parameter.

        q, dq, ddq are (n, J) in rad and s, m and s at a prismatic joint.
        """
        q, dq, ddq = (np.ascontiguousarray(state, dtype=float) for state in (q, dq, ddq))
        return self.along(q, dq, ddq, geometry.array())

    def _torque(self, q, dq, ddq, X, geometry: Geometry) -> NDArray:
        q, dq, ddq = (np.array(v, dtype=float)[np.newaxis] for v in (q, dq, ddq))
        return np.asarray(self.regressor(q, dq, ddq, geometry)[0] @ np.asarray(X, dtype=float))

    def mass_matrix(self, q, X, geometry: Geometry) -> NDArray:
        """M(q), (J, J) kg·m²: what unit acceleration of each joint adds to the torque (Walker and
        Orin, 1982)."""
        still, weightless = np.zeros(len(self.kinds)), replace(geometry, gravity_m_s2=0.0)
        at_rest = self._torque(q, still, still, X, weightless)
        return np.column_stack(
            [self._torque(q, still, unit, X, weightless) - at_rest for unit in np.eye(len(still))]
        )

    def coriolis_matrix(self, q, dq, X, geometry: Geometry) -> NDArray:
        """C(q, dq), (J, J) N·m·s/rad, in Christoffel form, so that dM/dt - 2 C is skew.

        The velocity torque is a quadratic form in dq; its polarisation is the Christoffel matrix.
        """
        still, weightless = np.zeros(len(self.kinds)), replace(geometry, gravity_m_s2=0.0)
        dq = np.asarray(dq, dtype=float)
        at_rest = self._torque(q, still, still, X, weightless)

        def quadratic(velocity):
            return self._torque(q, velocity, still, X, weightless) - at_rest

        units = np.eye(len(still))
        return np.column_stack(
            [0.5 * (quadratic(dq + unit) - quadratic(dq) - quadratic(unit)) for unit in units]
        )

    def gravity_torque(self, q, X, geometry: Geometry) -> NDArray:
        """G(q), (J,) N·m: the torque that holds the machine still."""
        still = np.zeros(len(self.kinds))
        return self._torque(q, still, still, X, geometry)

    def least_inertia(self, X, geometry: Geometry) -> tuple[float, float, NDArray]:
        """Return the least eigenvalue of what ``inertia_forms`` make of X (p,), the largest, and
        its slope (p,).

        The least is above nought where masses are, and along its own eigenvector it is linear in X.
        """
        forms = self.inertia_forms(geometry)
        inertias, axes = np.linalg.eigh(np.tensordot(np.asarray(X, dtype=float), forms, 1))
        return (
            float(inertias[0]),
            float(inertias[-1]),
            np.einsum("j,ijk,k->i", axes[:, 0], forms, axes[:, 0]),
        )

    def unrealizable(self, X, geometry: Geometry) -> list[str]:
        """Say which conditions of a real machine the parameters X (p,) break; empty when none."""
        return self.broken(np.asarray(X, dtype=float), geometry)
