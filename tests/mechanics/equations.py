"""Coriolis matrix and gravity of a mechanism from its regressor, and the potential of a leg."""

from dataclasses import replace

import numpy as np


def torque(mechanism, q, dq, ddq, X, geometry):
    """Return the drives' torque at one instant, (J,)."""
    q, dq, ddq = (np.array(v, dtype=float)[np.newaxis] for v in (q, dq, ddq))
    return mechanism.regressor(q, dq, ddq, geometry)[0] @ np.asarray(X, dtype=float)


def coriolis_matrix(mechanism, q, dq, X, geometry):
    """Return C(q, dq), (J, J), in Christoffel form, with which dM/dt - 2 C is skew-symmetric.

    The velocity torque is a quadratic form in dq, and its polarisation is the Christoffel matrix.
    """
    still, weightless = np.zeros(len(mechanism.kinds)), replace(geometry, gravity_m_s2=0.0)
    dq = np.asarray(dq, dtype=float)
    at_rest = torque(mechanism, q, still, still, X, weightless)

    def quadratic(velocity):
        return torque(mechanism, q, velocity, still, X, weightless) - at_rest

    units = np.eye(len(still))
    return np.column_stack(
        [0.5 * (quadratic(dq + unit) - quadratic(dq) - quadratic(unit)) for unit in units]
    )


def gravity_torque(mechanism, q, X, geometry):
    """Return the torque G(q) that holds the machine at rest, (J,)."""
    still = np.zeros(len(mechanism.kinds))
    return torque(mechanism, q, still, still, X, geometry)


def potential_energy(q, X, geometry):
    """Return the potential energy of a leg, J, zero with both joint axes level.

    Source: paper, eq. 3 and 4, in terms of X.
    """
    q1, q2 = q
    # Angles count from hanging down, so that mass below the hip's axis has negative energy.
    return -geometry.gravity_m_s2 * float(X[3] * np.cos(q1) + X[2] * np.cos(q1 + q2))
