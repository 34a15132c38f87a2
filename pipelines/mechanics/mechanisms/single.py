"""One joint: a pendulum, a turntable, a slide or a lift.

===========  =========  =======  ==========================================================
mechanism    joint      gravity  torque or force of the drive
===========  =========  =======  ==========================================================
pendulum     revolute   yes      X1 ddq + X2 g sin q, with q from the downward vertical
turntable    revolute   no       X1 ddq
lift         prismatic  yes      X1 ddq + X2
slide        prismatic  no       X1 ddq
===========  =========  =======  ==========================================================

Gravity pulls a prismatic joint with the same force at every position. Counterweights and springs
of constant force do so too, and heavy axes mostly have one; so X2 of a lift is the sum of these
forces, and not X1 times gravity.
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
def _inertia_along(q, dq, ddq, geometry):
    Y = np.empty((q.shape[0], 1, 1))
    Y[:, :, 0] = ddq
    return Y


@njit(REACTION, cache=True)
def _inertia(at, state, values, geometry, joint, out):
    """Add X1 ddq."""
    out[0] += values[0] * at.ddq[0]


@njit(cache=True)
def _pendulum_along(q, dq, ddq, geometry):
    Y = np.empty((q.shape[0], 1, 2))
    Y[:, :, 0] = ddq
    Y[:, :, 1] = geometry[1] * np.sin(q)
    return Y


@njit(REACTION, cache=True)
def _pendulum(at, state, values, geometry, joint, out):
    """Add X1 ddq + X2 g sin q."""
    out[0] += values[0] * at.ddq[0] + values[1] * geometry[1] * sin(at.q[0])


@njit(REACTION, cache=True)
def _mass_off_axis(at, state, values, geometry, joint, out):
    """Add Y g cos q: a mass across the link equals one along it, a right angle ahead."""
    out[0] += values[0] * geometry[1] * cos(at.q[0])


@njit(REACTION, cache=True)
def _payload_change(at, state, values, geometry, joint, out):
    """Add the point mass p / r at r from its time on: p (r ddq + g sin q)."""
    if at.t >= values[1]:
        out[0] += values[0] * (values[2] * at.ddq[0] + geometry[1] * sin(at.q[0]))


@njit(REACTION, cache=True)
def _mass_change(at, state, values, geometry, joint, out):
    """Add a mass from its time on: m (ddq + g), with g = 0 for a level joint."""
    if at.t >= values[1]:
        out[0] += values[0] * (at.ddq[0] + geometry[1])


@njit(cache=True)
def _lift_along(q, dq, ddq, geometry):
    Y = np.ones((q.shape[0], 1, 2))
    Y[:, :, 0] = ddq
    return Y


@njit(REACTION, cache=True)
def _lift(at, state, values, geometry, joint, out):
    """Add X1 ddq + X2."""
    out[0] += values[0] * at.ddq[0] + values[1]


def _broken_inertia(X: NDArray, geometry: Geometry) -> list[str]:
    text = f"X1 = {X[0]:.4g} kg·m² is not positive: every rotating part has inertia"
    return [text] if X[0] <= 0 else []


def _broken_mass(X: NDArray, geometry: Geometry) -> list[str]:
    text = f"X1 = {X[0]:.4g} kg is not positive: every sliding part has mass"
    return [text] if X[0] <= 0 else []


_ABSORBED = {"inertia": "X1", "gain": "all parameters together"}
"""Torques that only a second joint, which carries the same links, could separate."""

_INERTIA = Inertial(
    "X1", "kg·m²", "inertia about the joint's axis, the drive's rotor included", (0.001, 10.0)
)
_MASS = Inertial("X1", "kg", "mass along the axis, the drive's rotor included", (0.1, 200.0))

PENDULUM = Mechanism(
    name="single",
    title="one revolute joint under gravity: a pendulum, one joint of a leg",
    kinds=("revolute",),
    places=("joint",),
    has_gravity=True,
    parameters=(
        _INERTIA,
        Inertial("X2", "kg·m", "first moment of mass about the joint's axis", (0.01, 10.0)),
    ),
    along=_pendulum_along,
    bends_at=("joint",),
    reactions={
        "rigid_bodies": _pendulum,
        "mass_across": _mass_off_axis,
        "payload": _payload_change,
    },
    broken=_broken_inertia,
    # Only X1 is constrained. X2 may have any sign, because a link may be overbalanced.
    inertia_forms=lambda geometry: np.array([[[1.0]], [[0.0]]]),
    absorbs=_ABSORBED,
)

TURNTABLE = replace(
    PENDULUM,
    title="one revolute joint without gravity: its axis is vertical, or its load balanced",
    has_gravity=False,
    parameters=(_INERTIA,),
    along=_inertia_along,
    # Without gravity, the torque of one joint depends on its acceleration alone.
    bends_at=(),
    reactions={"rigid_bodies": _inertia},
    inertia_forms=lambda geometry: np.array([[[1.0]]]),
)

SLIDE = replace(
    TURNTABLE,
    title="one level prismatic joint",
    kinds=("prismatic",),
    parameters=(_MASS,),
    reactions={"rigid_bodies": _inertia, "payload": _mass_change},
    broken=_broken_mass,
)

LIFT = replace(
    SLIDE,
    title="one prismatic joint that gravity pulls along",
    has_gravity=True,
    parameters=(
        _MASS,
        Inertial(
            "X2",
            "N",
            "force that holds it at rest: its weight less a counterweight's",
            (-500.0, 500.0),
        ),
    ),
    along=_lift_along,
    reactions={"rigid_bodies": _lift, "payload": _mass_change},
    inertia_forms=lambda geometry: np.array([[[1.0]], [[0.0]]]),
    absorbs=_ABSORBED | {"constant": "X2"},
)
