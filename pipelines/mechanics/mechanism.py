"""A mechanism: its joints, and the torque that its rigid bodies require of them.

Each mechanism is one file with its regressor, torque = A(q, dq, ddq) X. The mass matrix
is computed from it here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joint_units import Kind
from pipelines.mechanics.geometry import Geometry


class Inertial(NamedTuple):
    """An inertial parameter."""

    name: str
    unit: str
    meaning: str
    typical: tuple[float, float]
    """Range on exoskeletons, or on a test bench."""


@dataclass(frozen=True)
class Mechanism:
    """Joints of given kinds and the rigid bodies between them: J joints, p inertial parameters."""

    name: str
    """Name in exoid.toml, such as ``leg``; shared by variants in kind of joint or gravity."""
    title: str
    """Its joints, and after an optional colon the machines that it represents."""
    kinds: tuple[Kind, ...]
    """Kinds of its joints, from the base on."""
    places: tuple[str, ...]
    """Names of its joints in effects, whatever a file calls them: ``hip``, ``knee``; ``joint``."""
    has_gravity: bool | None
    """Whether gravity acts on it; None if it is the same with and without."""
    parameters: tuple[Inertial, ...]
    along: Callable[[NDArray, NDArray, NDArray, NDArray], NDArray]
    """Compiled function of q, dq, ddq, (n, J) each, and the geometry's array that returns the
    regressor, (n, J, p)."""
    bends_at: tuple[str, ...]
    """Places of the joints on whose positions its torque depends; empty if it depends on
    acceleration alone."""
    reactions: Mapping[str, Any] = field(hash=False, compare=False)
    """Compiled equations that depend on the mechanism: of its ``rigid_bodies``, of a mass
    ``mass_across`` a link, of a ``payload`` that comes or goes. An effect without one cannot
    occur."""
    broken: Callable[[NDArray, Geometry], list[str]] = field(hash=False, compare=False)
    """Function that lists the conditions of a real machine that the parameters X violate."""
    inertia_forms: Callable[[Geometry], NDArray] = field(hash=False, compare=False)
    """Function that returns symmetric B, (p, m, m). M(q) > 0 at every q if and only if the sum of
    X_i B_i is: the same conditions in the form of a convex program."""
    absorbs: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    """Kinds of torque that its own parameters absorb completely, and which parameters those are:
    an ``inertia`` at a joint, a ``gain`` of the whole torque, a ``constant`` torque."""
    has_length: bool = False
    """Whether its equations contain the distance between the first two axes, ``thigh_length_m``."""

    @property
    def joints_in_words(self) -> str:
        """Its joints, as messages name them."""
        return self.title.partition(":")[0]

    def regressor(self, q: NDArray, dq: NDArray, ddq: NDArray, geometry: Geometry) -> NDArray:
        """Return the regressor A along a motion.

        Parameters
        ----------
        q, dq, ddq : (n, J) array
            Angle, velocity and acceleration in rad and s; m and s at a prismatic joint.
        geometry : Geometry
            Lengths and gravity.

        Returns
        -------
        (n, J, p) array
            Torque in N·m (N at a prismatic joint) per unit of each parameter.
        """
        # Compiled regressors accept only contiguous arrays of doubles.
        q, dq, ddq = (np.ascontiguousarray(state, dtype=float) for state in (q, dq, ddq))
        return self.along(q, dq, ddq, geometry.array())

    def _torque(self, q, dq, ddq, X, geometry: Geometry) -> NDArray:
        q, dq, ddq = (np.array(v, dtype=float)[np.newaxis] for v in (q, dq, ddq))
        return np.asarray(self.regressor(q, dq, ddq, geometry)[0] @ np.asarray(X, dtype=float))

    def mass_matrix(self, q, X, geometry: Geometry) -> NDArray:
        """Return the mass matrix M(q), (J, J) kg·m².

        Its columns are the torques of unit accelerations (Walker and Orin, 1982).

        Parameters
        ----------
        q : (J,) array
            Angles, rad.
        X : (p,) array
            Inertial parameters.
        geometry : Geometry
            Lengths.
        """
        # Without gravity a lift at rest still needs its constant force X2, which is subtracted.
        still, weightless = np.zeros(len(self.kinds)), replace(geometry, gravity_m_s2=0.0)
        at_rest = self._torque(q, still, still, X, weightless)
        return np.column_stack(
            [self._torque(q, still, unit, X, weightless) - at_rest for unit in np.eye(len(still))]
        )

    def least_inertia(self, X, geometry: Geometry) -> tuple[float, float, NDArray]:
        """Return the extreme eigenvalues of the inertia form of X (p,).

        The least is positive for real masses, and linear in X along its own eigenvector.

        Returns
        -------
        least, greatest : float
            Eigenvalues.
        slope : (p,) array
            Derivative of the least one.
        """
        forms = self.inertia_forms(geometry)
        inertias, axes = np.linalg.eigh(np.tensordot(np.asarray(X, dtype=float), forms, 1))
        # The derivative of a simple eigenvalue with unit eigenvector v is v' B_i v.
        slope = np.einsum("j,ijk,k->i", axes[:, 0], forms, axes[:, 0])
        return float(inertias[0]), float(inertias[-1]), slope

    def unrealizable(self, X, geometry: Geometry) -> list[str]:
        """List the conditions of a real machine that inertial parameters violate.

        Parameters
        ----------
        X : (p,) array
            Inertial parameters, SI units.
        geometry : Geometry
            Lengths, m, and gravity, m/s².

        Returns
        -------
        list of str
            A sentence for each condition; empty if all hold.
        """
        return self.broken(np.asarray(X, dtype=float), geometry)
