"""The leg: two revolute joints in series, two rigid links, four inertial parameters.

The regressor is the only place with the equations of motion. Angles: the first (hip) counts from
the downward vertical, the second (knee) from the first link, flexion negative; any double pendulum
is a leg. The paper prints several of these formulas with errors; ``docs/errata.md`` has the
corrected forms, with a test for each.

If gravity does not act in the plane of motion, as for a planar arm, nothing depends on X4, nor on
the first joint's position.
"""

from dataclasses import replace
from math import cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.instant import REACTION
from pipelines.mechanics.mechanism import Inertial, Mechanism


@njit(cache=True)
def regressor_rows(sin_hip, sin_leg, sin_knee, cos_knee, dq, ddq, thigh_length, gravity):
    """Return the rows hip and knee of A(q, dq, ddq): torque = A @ (X1, X2, X3, X4).

    Source: paper, appendix A, with row 2 corrected as in docs/errata.md.

    Parameters
    ----------
    sin_hip, sin_leg, sin_knee, cos_knee : float
        Of q1, q1 + q2 and q2; arguments, because a caller that evaluates thousands of motions has a
        faster way to compute them.
    dq, ddq : sequence of float
        Velocities and accelerations of hip and knee, rad/s and rad/s².
    thigh_length, gravity : float
        m and m/s².

    Returns
    -------
    tuple
        Two tuples of four floats, N·m per unit.
    """
    shank_gravity = gravity * sin_leg
    # Tuples, because an array for every integration step would cost more than the equations.
    # Columns X1 to X4. X3 couples the links; X4 is a pure gravity term.
    hip = (
        ddq[0],
        ddq[1],
        thigh_length
        * ((2.0 * ddq[0] + ddq[1]) * cos_knee - (2.0 * dq[0] * dq[1] + dq[1] * dq[1]) * sin_knee)
        + shank_gravity,
        gravity * sin_hip,
    )
    # Without X1 and X4, because the thigh's own inertia and weight load only the hip. The shank has
    # a centrifugal term in dq1², because the thigh carries the knee around the hip.
    knee = (
        0.0,
        ddq[0] + ddq[1],
        thigh_length * (ddq[0] * cos_knee + dq[0] * dq[0] * sin_knee) + shank_gravity,
        0.0,
    )
    return hip, knee


@njit("UniTuple(UniTuple(f8, 4), 2)(f8[::1], f8[::1], f8[::1], f8, f8)", cache=True)
def regressor_at(q, dq, ddq, thigh_length, gravity):
    """Return the rows hip and knee of A(q, dq, ddq) at one instant.

    Parameters
    ----------
    q, dq, ddq : (2,) array
        Angles, velocities and accelerations, rad, rad/s and rad/s².
    thigh_length, gravity : float
        m and m/s².

    Returns
    -------
    tuple
        Two tuples of four floats, N·m per unit.
    """
    return regressor_rows(
        sin(q[0]), sin(q[0] + q[1]), sin(q[1]), cos(q[1]), dq, ddq, thigh_length, gravity
    )


@njit(cache=True)
def _along(q, dq, ddq, geometry):
    """Return the rigid-body regressor of a whole motion, (n, 2, 4)."""
    Y = np.empty((q.shape[0], 2, 4))
    for k in range(q.shape[0]):
        rows = regressor_at(q[k], dq[k], ddq[k], geometry[0], geometry[1])
        for j in range(2):
            for i in range(4):
                Y[k, j, i] = rows[j][i]
    return Y


@njit(REACTION, cache=True)
def _rigid_body(at, state, values, geometry, joint, out):
    """Add A(q, dq, ddq) X, without X4 for a leg without gravity."""
    hip, knee = regressor_at(at.q, at.dq, at.ddq, geometry[0], geometry[1])
    for i in range(len(values)):
        out[0] += hip[i] * values[i]
        out[1] += knee[i] * values[i]


@njit(cache=True)
def _level_along(q, dq, ddq, geometry):
    """Return the rigid-body regressor of a whole motion without gravity, (n, 2, 3)."""
    return np.ascontiguousarray(_along(q, dq, ddq, geometry)[:, :, :3])


@njit(REACTION, cache=True)
def _mass_off_axis(at, state, values, geometry, joint, out):
    """Add the column of X4 (hip) or X3 (knee) a right angle ahead."""
    q, leg = at.q, at.q[0] + at.q[1]
    # sin and cos of an angle a right angle ahead are the cos and -sin of the angle.
    hip, knee = regressor_rows(
        cos(q[0]), cos(leg), cos(q[1]), -sin(q[1]), at.dq, at.ddq, geometry[0], geometry[1]
    )
    # X4 belongs to the thigh (joint 0), X3 to the shank (joint 1). The other columns, whose angles
    # do not shift, are not used.
    column = 3 - joint
    out[0] += values[0] * hip[column]
    out[1] += values[0] * knee[column]


@njit(REACTION, cache=True)
def _payload_change(at, state, values, geometry, joint, out):
    """Add the contribution of a point mass to X1..X4 from its time on."""
    if at.t < values[1]:
        return
    # A mass m at r on the thigh adds m r² to X1 and m r to X4. On the shank it adds to X1..X4
    # m (L1² + r²), m r², m r and m L1. The amplitude is p = m r.
    moment, r, length = values[0], values[2], geometry[0]
    hip, knee = regressor_at(at.q, at.dq, at.ddq, geometry[0], geometry[1])
    if joint == 0:
        out[0] += moment * (hip[3] + r * hip[0])
    else:
        out[0] += moment * (
            hip[2] + r * hip[1] + (r + length * length / r) * hip[0] + length / r * hip[3]
        )
        out[1] += moment * (knee[2] + r * knee[1])


def _broken(X: NDArray, geometry: Geometry) -> list[str]:
    """List violated conditions of a real leg: X2 > 0 and X2 (X1 - X2) > (L1 X3)².

    They are equivalent to M(q) > 0 at every knee angle.
    """
    X1, X2, X3 = X[:3]
    broken = []
    if X2 <= 0:
        broken.append(f"X2 = {X2:.4g} kg·m² is not positive: every shank has inertia")
    # det M = X2 (X1 - X2) - (L1 X3 cos q2)² is least at cos q2 = ±1.
    if X2 * (X1 - X2) <= (geometry.thigh_length_m * X3) ** 2:
        broken.append(
            f"X2 (X1 - X2) = {X2 * (X1 - X2):.4g} is not above (L1 X3)² ="
            f" {(geometry.thigh_length_m * X3) ** 2:.4g} kg²·m⁴: the mass matrix is not positive"
            " definite"
        )
    return broken


def _inertia_forms(geometry: Geometry) -> NDArray:
    """Return symmetric B, (4, 2, 2): M(q) > 0 at every knee angle if and only if sum X_i B_i > 0.

    The sum is [[X1 - X2, L1 X3], [L1 X3, X2]]. Its determinant and last element are the conditions
    of ``_broken``; it is linear in X, as a convex program requires.
    """
    L1 = geometry.thigh_length_m
    return np.array(
        [[[1, 0], [0, 0]], [[-1, 0], [0, 1]], [[0, L1], [L1, 0]], [[0, 0], [0, 0]]], dtype=float
    )


LEG = Mechanism(
    name="leg",
    title=(
        "two revolute joints in series, whose axes are parallel, under gravity: a leg, any double"
        " pendulum"
    ),
    kinds=("revolute", "revolute"),
    places=("hip", "knee"),
    has_gravity=True,
    parameters=(
        Inertial(
            "X1", "kg·m²", "inertia about the hip with the knee at a right angle", (1.0, 12.0)
        ),
        Inertial("X2", "kg·m²", "inertia of the shank about the knee", (0.2, 4.0)),
        Inertial("X3", "kg·m", "first moment of the shank about the knee", (0.5, 3.0)),
        Inertial(
            "X4",
            "kg·m",
            "first moment of the thigh, shank's mass at the knee, about the hip",
            (1.0, 8.0),
        ),
    ),
    along=_along,
    bends_at=("hip", "knee"),
    reactions={
        "rigid_bodies": _rigid_body,
        "mass_across": _mass_off_axis,
        "payload": _payload_change,
    },
    broken=_broken,
    inertia_forms=_inertia_forms,
    has_length=True,
)

LEVEL_LEG = replace(
    LEG,
    title=(
        "two revolute joints in series whose parallel axes are vertical, or their links balanced: a"
        " planar arm"
    ),
    has_gravity=False,
    parameters=LEG.parameters[:3],
    bends_at=("knee",),
    along=_level_along,
    inertia_forms=lambda geometry: _inertia_forms(geometry)[:3],
)


def cuff_torque(thigh, shank, q, geometry: Geometry) -> NDArray:
    """Return the torque of the exoskeleton on the leg, from the cuff forces.

    Parameters
    ----------
    thigh, shank : (n, 3) array
        Sum of front and back sensor in the segment's frame, N: x distal, y forward, z lateral.
    q : (n, 2) array
        Joint angles, rad.
    geometry : Geometry
        Lengths, with the positions of both cuffs.

    Returns
    -------
    (n, 2) array
        Torque about hip and knee, N·m.

    Raises
    ------
    ValueError
        If the geometry has no cuffs.
    """
    d_thigh, d_shank = geometry.thigh_cuff_distance_m, geometry.shank_cuff_distance_m
    if d_thigh is None or d_shank is None:
        raise ValueError("cuff distances are not set: the geometry has no cuffs")
    knee = d_shank * shank[:, 1]
    # Component of the shank's force across the thigh, which acts on the hip by the lever L1.
    along = shank[:, 1] * np.cos(q[:, 1]) + shank[:, 0] * np.sin(q[:, 1])
    return np.column_stack([d_thigh * thigh[:, 1] + knee + geometry.thigh_length_m * along, knee])
