"""The effective inertia at the motors, and the fastest rate of a feedback loop around it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.dynamics.assembly import Assembly
from pipelines.dynamics.forward import (
    DTHETA,
    Q,
    accelerations,
    memory_size,
    resting_state,
    workspace,
)
from pipelines.effects.kernel import ALLOCATING_NOTHING
from pipelines.errors import InputError


@njit(**ALLOCATING_NOTHING)
def _masses(a, w, poses, memory, state, still, drive, rates, mass, mobility):
    """Write mass matrices and mobilities, (k, J, J) each, at poses (k, J)."""
    joints = a.joints
    for k in range(len(poses)):
        for j in range(joints):
            state[Q, j] = poses[k, j]
        # First without torque, then with one newton metre at each drive in turn.
        for pushed in range(-1, joints):
            for j in range(joints):
                drive[j] = 1.0 if j == pushed else 0.0
            accelerations(a, w, 0.0, state, memory, still, still, drive, rates)
            for i in range(joints):
                for j in range(joints):
                    if pushed < 0:
                        # Less the acceleration without torque, in which gravity and springs act.
                        mass[k, i, j], mobility[k, i, j] = w.mass[i, j], -rates[DTHETA, i]
                    elif pushed == j:
                        mobility[k, i, j] += rates[DTHETA, i]


def _poses(joints: int) -> NDArray:
    """Return joint angles, (k, J) rad; no mass matrix depends on the first joint's."""
    if joints < 3:
        # A leg's mass matrix is even in the knee's angle only while the shank's mass is on its
        # axis. One joint has the same mass at each angle.
        poses = np.zeros((121, joints))
        poses[:, -1] = np.linspace(-np.pi, np.pi, len(poses))
        return poses
    # Only here: to import all of scipy.stats takes a third of a second.
    from scipy.stats import qmc

    count = 500
    poses = np.zeros((count, joints))
    poses[:, 1:] = np.pi * (2.0 * qmc.Halton(joints - 1, scramble=False).random(count) - 1.0)
    return poses


def masses(a: Assembly) -> tuple[NDArray, NDArray]:
    """Return the links' mass matrix and the motors' mobility at k poses.

    Returns
    -------
    mass : (k, J, J) array
        Mass matrix of the links, kg·m².
    mobility : (k, J, J) array
        Acceleration of the motors per drive torque, 1/(kg·m²).
    """
    poses, joints = _poses(a.joints), a.joints
    mass, mobility = np.empty((2, len(poses), joints, joints))
    state, still = resting_state(np.zeros(joints)), np.zeros(joints)
    scratch = np.zeros(memory_size(a)), state, still, still.copy(), np.zeros((4, joints))
    _masses(a, workspace(joints), poses, *scratch, mass, mobility)
    return mass, mobility


def substeps_for(a: Assembly, feedback_gain: float, period: float) -> int:
    """Return the number of integration steps per sample for which a speed feedback is stable.

    Parameters
    ----------
    a : Assembly
        Model to be simulated.
    feedback_gain : float
        Gain of the feedback, N·m·s/rad.
    period : float
        Time between two samples, s.

    Raises
    ------
    InputError
        If it exceeds 200, because the model hardly has mass at some pose.
    """
    # Greatest product of step and fastest rate; the Runge-Kutta method is stable up to 2.78, but
    # accurate only below.
    stable_reach = 1.5
    mobility = float(np.abs(np.linalg.eigvals(masses(a)[1])).max())
    # The fastest rate of the loop is gain times mobility, 1/s.
    needed = feedback_gain * mobility * period / stable_reach
    # Most integration steps per sample. At the default gain and rate, more correspond to an
    # inertia below 1e-3 kg·m², less than that of rotors.
    most = 200
    if not needed <= most:
        raise InputError(
            f"the effective inertia falls to {1.0 / mobility:.2g} kg·m² at some pose: a simulation"
            f" with a feedback of {feedback_gain:g} N·m·s/rad at {1.0 / period:g} Hz is unstable."
            " Identify the model again from richer motions, or reduce the feedback gain"
        )
    return max(1, int(np.ceil(needed)))
