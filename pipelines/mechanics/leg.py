"""The leg: hip and knee, two rigid links, and the paper's four inertial parameters.

The regressor is the only place where the equations of motion stand; mass matrix, Coriolis
matrix and gravity are read off it. Angles: hip from the downward vertical, knee relative to
the thigh, flexion negative. The paper prints several of these formulas with slips; the mended
forms and a test for each are in ``docs/errata.md``.
"""

from dataclasses import asdict, dataclass
from math import cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

INERTIAL = ("X1", "X2", "X3", "X4")


@dataclass(frozen=True)
class Geometry:
    """Lengths and gravity that are measured, not identified. SI units."""

    thigh_length_m: float = 0.38952
    gravity_m_s2: float = 9.8
    thigh_cuff_distance_m: float | None = None
    """Hip axis to thigh cuff; None where there are no cuff forces."""
    shank_cuff_distance_m: float | None = None
    """Knee axis to shank cuff; None where there are no cuff forces."""

    def metadata(self) -> dict[str, float]:
        """Return what a file says of it; lengths that are not known are left out."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    def array(self) -> NDArray:
        """Return what compiled kernels receive as ``geometry``: thigh length (m), gravity (m/s²)."""
        return np.array([self.thigh_length_m, self.gravity_m_s2])


@njit(cache=True)
def regressor_rows(sin_hip, sin_leg, sin_knee, cos_knee, dq, ddq, thigh_length, gravity):
    """Rows hip and knee of A(q, dq, ddq): torque = A @ (X1, X2, X3, X4).

    Paper, appendix A, row 2 renumbered as docs/errata.md gives it. ``sin_leg`` is sin(q1 + q2). The sines
    are arguments, because whoever evaluates thousands of motions has a faster way to them. Tuples, because
    an array made at every integration step would cost more than the equations.
    """
    shank_gravity = gravity * sin_leg
    hip = (
        ddq[0],
        ddq[1],
        thigh_length * ((2.0 * ddq[0] + ddq[1]) * cos_knee - (2.0 * dq[0] * dq[1] + dq[1] * dq[1]) * sin_knee)
        + shank_gravity,
        gravity * sin_hip,
    )
    knee = (0.0, ddq[0] + ddq[1], thigh_length * (ddq[0] * cos_knee + dq[0] * dq[0] * sin_knee) + shank_gravity, 0.0)
    return hip, knee


@njit("UniTuple(UniTuple(f8, 4), 2)(f8[::1], f8[::1], f8[::1], f8, f8)", cache=True)
def regressor_at(q, dq, ddq, thigh_length, gravity):
    """Rows hip and knee of A(q, dq, ddq) at one instant."""
    return regressor_rows(sin(q[0]), sin(q[0] + q[1]), sin(q[1]), cos(q[1]), dq, ddq, thigh_length, gravity)


@njit(cache=True)
def regressor(q, dq, ddq, thigh_length, gravity):
    """Rigid-body regressor of a whole motion.

    Parameters
    ----------
    q, dq, ddq : (n, 2) C-contiguous arrays
        Angle (rad), velocity (rad/s), acceleration (rad/s²) of hip and knee.
    thigh_length, gravity : float
        m and m/s².

    Returns
    -------
    (n, 2, 4) array
        Torque in N·m per unit of X1, X2 (kg·m²), X3, X4 (kg·m).
    """
    Y = np.empty((q.shape[0], 2, 4))
    for k in range(q.shape[0]):
        rows = regressor_at(q[k], dq[k], ddq[k], thigh_length, gravity)
        for j in range(2):
            for i in range(4):
                Y[k, j, i] = rows[j][i]
    return Y


def _torque(q, dq, ddq, X, geometry: Geometry, gravity: float) -> NDArray:
    q, dq, ddq = (np.array(v, dtype=float)[np.newaxis] for v in (q, dq, ddq))
    return regressor(q, dq, ddq, geometry.thigh_length_m, gravity)[0] @ np.asarray(X, dtype=float)


def mass_matrix(q, X, geometry: Geometry) -> NDArray:
    """M(q), (2, 2) kg·m²: the torque at unit acceleration of each joint (Walker and Orin, 1982)."""
    still = np.zeros(2)
    return np.column_stack([_torque(q, still, unit, X, geometry, 0.0) for unit in np.eye(2)])


def coriolis_matrix(q, dq, X, geometry: Geometry) -> NDArray:
    """C(q, dq), (2, 2) N·m·s/rad, in Christoffel form, so that dM/dt - 2 C is skew.

    The velocity torque is a quadratic form in dq; its polarisation is the Christoffel matrix.
    """
    still = np.zeros(2)
    dq = np.asarray(dq, dtype=float)

    def quadratic(velocity):
        return _torque(q, velocity, still, X, geometry, 0.0)

    return np.column_stack([0.5 * (quadratic(dq + unit) - quadratic(dq) - quadratic(unit)) for unit in np.eye(2)])


def gravity_torque(q, X, geometry: Geometry) -> NDArray:
    """G(q), (2,) N·m: the torque that holds the leg still."""
    still = np.zeros(2)
    return _torque(q, still, still, X, geometry, geometry.gravity_m_s2)


def potential_energy(q, X, geometry: Geometry) -> float:
    """Potential energy in J, zero with both joint axes level (paper eq. 3 and 4 in terms of X)."""
    q1, q2 = q
    return -geometry.gravity_m_s2 * float(X[3] * cos(q1) + X[2] * cos(q1 + q2))


def unrealizable(X, geometry: Geometry) -> list[str]:
    """Say which conditions of a real leg the parameters break; empty when none.

    M(q) > 0 for every knee angle if and only if X2 > 0 and X2 (X1 - X2) > (L1 X3)².
    """
    X1, X2, X3, _ = X
    broken = []
    if X2 <= 0:
        broken.append(f"X2 = {X2:.4g} kg·m² is not positive: the shank would have no inertia")
    if X2 * (X1 - X2) <= (geometry.thigh_length_m * X3) ** 2:
        broken.append(
            f"X2 (X1 - X2) = {X2 * (X1 - X2):.4g} is not above (L1 X3)² = "
            f"{(geometry.thigh_length_m * X3) ** 2:.4g} kg²·m⁴: the mass matrix is not positive definite"
        )
    return broken


def cuff_torque(thigh, shank, q, geometry: Geometry) -> NDArray:
    """Torque of the exoskeleton on the leg from the cuff forces, (n, 2) N·m about hip and knee.

    Parameters
    ----------
    thigh, shank : (n, 3) arrays
        Sum of front and back sensor in the segment's frame, N: x distal, y forward, z lateral.
    q : (n, 2) array
        Joint angles, rad.
    """
    d_thigh, d_shank = geometry.thigh_cuff_distance_m, geometry.shank_cuff_distance_m
    if d_thigh is None or d_shank is None:
        raise ValueError("cuff distances are not set: the geometry has no cuffs")
    knee = d_shank * shank[:, 1]
    along = shank[:, 1] * np.cos(q[:, 1]) + shank[:, 0] * np.sin(q[:, 1])
    return np.column_stack([d_thigh * thigh[:, 1] + knee + geometry.thigh_length_m * along, knee])
