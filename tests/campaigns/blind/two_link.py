"""Closed-form dynamics of a leg of two links in a plane, from its Lagrangian.

With the links' angles from the vertical, f1 = q1 and f2 = q1 + q2, forward and down as axes, and
each centre of mass
``along`` and ``forward`` of its link::

    T = A f1'^2 / 2 + B f2'^2 / 2 + h(f2 - f1) f1' f2',      h(d) = C cos d - D sin d V = -g (m1 cos
    f1 - n1 sin f1 + m2 cos f2 - n2 sin f2)

A and B are the inertias about the hip (of all that the thigh carries) and the knee, C and D the
shank's moments times the thigh's length, m and n the moments along and in front of the axes. The
equations of motion are those of Lagrange in q. Legs that move as one have the sums of their
coefficients.
"""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from tests.campaigns.blind.body import PAYLOAD_INERTIA, Leg
from tests.campaigns.blind.compiled import njit

A, B, C, D, M1, N1, M2, N2 = range(8)


def coefficients(leg: Leg) -> NDArray:
    """Return the eight coefficients of a leg, SI units."""
    t, s, length = leg.thigh, leg.shank, leg.length
    return np.array(
        [
            t.inertia + t.mass * (t.along**2 + t.forward**2) + s.mass * length**2,
            s.inertia + s.mass * (s.along**2 + s.forward**2),
            s.mass * length * s.along,
            s.mass * length * s.forward,
            t.mass * t.along + s.mass * length,
            t.mass * t.forward,
            s.mass * s.along,
            s.mass * s.forward,
        ]
    )


@njit()
def add_lump(c, joint, mass, distance, length, out):
    """Write coefficients ``c`` with a lump of mass down a segment's axis (0 thigh, 1 shank) into
    ``out``."""
    out[:] = c
    turned = mass * (distance * distance + PAYLOAD_INERTIA)
    if joint == 0:
        out[A] += turned
        out[M1] += mass * distance
    else:
        out[A] += mass * length * length
        out[B] += turned
        out[C] += mass * length * distance
        out[M1] += mass * length
        out[M2] += mass * distance


@njit()
def mass_and_bias(c, gravity, tilt, q1, q2, v1, v2, M, bias):
    """Write mass matrix (2, 2) and Coriolis, centrifugal and gravity torque (2,) for a base tilted
    by ``tilt``."""
    h = c[C] * cos(q2) - c[D] * sin(q2)
    slope = -c[C] * sin(q2) - c[D] * cos(q2)
    M[0, 0] = c[A] + c[B] + 2.0 * h
    M[0, 1] = M[1, 0] = c[B] + h
    M[1, 1] = c[B]
    f1 = q1 + tilt
    f2 = f1 + q2
    thigh = gravity * (c[M1] * sin(f1) + c[N1] * cos(f1))
    shank = gravity * (c[M2] * sin(f2) + c[N2] * cos(f2))
    bias[0] = slope * (2.0 * v1 * v2 + v2 * v2) + thigh + shank
    bias[1] = -slope * v1 * v1 + shank


@njit()
def inverse(c, gravity, tilt, q, dq, ddq):
    """Return the torque (n, 2) that moves a leg along a motion; ``tilt`` (n,) of the base."""
    torque = np.empty_like(q)
    M, bias = np.empty((2, 2)), np.empty(2)
    for k in range(len(q)):
        mass_and_bias(c, gravity, tilt[k], q[k, 0], q[k, 1], dq[k, 0], dq[k, 1], M, bias)
        for j in range(2):
            torque[k, j] = M[j, 0] * ddq[k, 0] + M[j, 1] * ddq[k, 1] + bias[j]
    return torque


@njit()
def accelerations(M, force, out):
    """Solve M out = force for two unknowns."""
    det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
    out[0] = (M[1, 1] * force[0] - M[0, 1] * force[1]) / det
    out[1] = (M[0, 0] * force[1] - M[1, 0] * force[0]) / det
