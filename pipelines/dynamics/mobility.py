"""What the motors feel of the leg's mass, and how fast a loop around it gets."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.stats import qmc

from pipelines.dynamics.assembly import Assembly
from pipelines.dynamics.forward import DTHETA, Q, accelerations, memory_size, resting_state, workspace

KNEE_ANGLES = np.linspace(0.0, np.pi, 61)
"""Where a leg's mass matrix is looked at, rad: it is even in the knee angle and depends on no other."""

MORE_POSES = 500
"""Of a machine of more than two joints."""

STABLE_REACH = 1.5
"""Step times fastest rate up to which the Runge-Kutta method is stable (2.78) and still accurate."""


@njit(cache=True)
def _masses(a, poses, memory, state):
    w, rates, still = workspace(a.joints), np.zeros((4, a.joints)), np.zeros(a.joints)
    mass = np.empty((len(poses), a.joints, a.joints))
    mobility = np.empty((len(poses), a.joints, a.joints))
    drive = np.zeros(a.joints)
    for k in range(len(poses)):
        state[Q] = poses[k]
        for j in range(a.joints):
            drive[j] = 1.0
            accelerations(a, w, 0.0, state, memory, w.direction, still, drive, rates)
            mobility[k, :, j] = rates[DTHETA]
            drive[j] = 0.0
        accelerations(a, w, 0.0, state, memory, w.direction, still, drive, rates)
        for j in range(a.joints):
            mobility[k, :, j] -= rates[DTHETA]
        mass[k] = w.mass
    return mass, mobility


def _poses(joints: int) -> NDArray:
    """Return joint angles, (k, J) rad: no mass matrix depends on where the first joint is."""
    poses = np.zeros((len(KNEE_ANGLES) if joints < 3 else MORE_POSES, joints))
    if joints < 3:
        poses[:, -1] = KNEE_ANGLES
    else:
        poses[:, 1:] = np.pi * (2.0 * qmc.Halton(joints - 1, scramble=False).random(MORE_POSES) - 1.0)
    return poses


def masses(a: Assembly) -> tuple[NDArray, NDArray]:
    """Return the links' mass matrix (kg·m²) and the motors' acceleration per drive torque, (k, J, J) each: k poses."""
    return _masses(a, _poses(a.joints), np.zeros(memory_size(a)), resting_state(np.zeros(a.joints)))


def substeps_for(a: Assembly, feedback_gain: float, period: float) -> int:
    """Return how many integration steps a sample needs so that a speed feedback (N·m·s/rad) stays stable."""
    fastest = feedback_gain * np.abs(np.linalg.eigvals(masses(a)[1])).max()
    return max(1, int(np.ceil(fastest * period / STABLE_REACH)))
