"""What the motors feel of the leg's mass, and how fast a loop around it gets."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.stats import qmc

from pipelines.dynamics.assembly import Assembly
from pipelines.dynamics.forward import (
    DTHETA,
    HOT,
    Q,
    accelerations,
    memory_size,
    resting_state,
    workspace,
)
from pipelines.errors import InputError

KNEE_ANGLES = np.linspace(0.0, np.pi, 61)
"""Where a leg's mass matrix is looked at, rad: it is even in the knee angle and depends on no
other."""

MORE_POSES = 500
"""Of a machine of more than two joints."""

STABLE_REACH = 1.5
"""Step times fastest rate up to which the Runge-Kutta method is stable (2.78) and still
accurate."""

MOST_STEPS = 200
"""Integration steps a sample: at the default gain and rate the motors then feel 1e-3 kg·m², less
than rotors have."""


@njit(**HOT)
def _masses(a, w, poses, memory, state, still, drive, rates, mass, mobility):
    """Write mass matrices and mobilities at poses (k, J) into ``mass`` and ``mobility`` (k, J,
    J)."""
    joints = a.joints
    for k in range(len(poses)):
        for j in range(joints):
            state[Q, j] = poses[k, j]
        # With no torque first, then with one newton metre at each drive in turn.
        for pushed in range(-1, joints):
            for j in range(joints):
                drive[j] = 1.0 if j == pushed else 0.0
            accelerations(a, w, 0.0, state, memory, still, still, drive, rates)
            for i in range(joints):
                for j in range(joints):
                    if pushed < 0:
                        mass[k, i, j], mobility[k, i, j] = w.mass[i, j], -rates[DTHETA, i]
                    elif pushed == j:
                        mobility[k, i, j] += rates[DTHETA, i]


def _poses(joints: int) -> NDArray:
    """Return joint angles, (k, J) rad: no mass matrix depends on where the first joint is."""
    poses = np.zeros((len(KNEE_ANGLES) if joints < 3 else MORE_POSES, joints))
    if joints < 3:
        poses[:, -1] = KNEE_ANGLES
    else:
        poses[:, 1:] = np.pi * (
            2.0 * qmc.Halton(joints - 1, scramble=False).random(MORE_POSES) - 1.0
        )
    return poses


def masses(a: Assembly) -> tuple[NDArray, NDArray]:
    """Return the links' mass matrices and the motors' acceleration per drive torque at some poses.

    Returns
    -------
    tuple of (k, J, J) arrays
        kg·m² and 1/(kg·m²), at k poses.
    """
    poses, joints = _poses(a.joints), a.joints
    mass, mobility = np.empty((2, len(poses), joints, joints))
    state, still = resting_state(np.zeros(joints)), np.zeros(joints)
    _masses(
        a,
        workspace(joints),
        poses,
        np.zeros(memory_size(a)),
        state,
        still,
        still.copy(),
        np.zeros((4, joints)),
        mass,
        mobility,
    )
    return mass, mobility


def substeps_for(a: Assembly, feedback_gain: float, period: float) -> int:
    """Return how many integration steps a sample needs so that a speed feedback (N·m·s/rad) stays
    stable.

    Raises
    ------
    InputError
        Where that is more than ``MOST_STEPS``: a model can be so light at some pose that it hardly
        has mass.
    """
    mobility = float(np.abs(np.linalg.eigvals(masses(a)[1])).max())
    needed = feedback_gain * mobility * period / STABLE_REACH
    if not needed <= MOST_STEPS:
        raise InputError(
            f"the motors feel as little as {1.0 / mobility:.2g} kg·m² at some pose of this model,"
            f" too little for a feedback of {feedback_gain:g} N·m·s/rad at {1.0 / period:g} Hz to"
            " be simulated. Identify it again from richer motions, or give smaller gains of"
            " feedback"
        )
    return max(1, int(np.ceil(needed)))
