"""Forces at the cuffs' sensors."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind.recorded import Rig


def pad_forces(rig: Rig, along: NDArray, across: NDArray, noise: Generator) -> NDArray:
    """Return the forces of four sensors (n, 4, 3) N: thigh front and back, shank front and back.

    Axes are distal, forward, lateral; ``along`` and ``across`` (n, 2) are the forces at thigh and
    shank.
    """
    machine = rig.machine
    forces = np.zeros((len(across), 4, 3))
    for i in range(2):
        # The back pushes forward, the front backward: pads press, they never pull.
        pressed = np.abs(across[:, i]) + machine.preload
        forces[:, 2 * i, 1] = 0.5 * (across[:, i] - pressed)
        forces[:, 2 * i + 1, 1] = 0.5 * (across[:, i] + pressed)
        forces[:, 2 * i : 2 * i + 2, 0] = 0.5 * along[:, i : i + 1]
    return forces + machine.cuff_zero + noise.normal(0.0, machine.cuff_noise, forces.shape)


def firm_forces(rig: Rig, q: NDArray, torque: NDArray) -> tuple[NDArray, NDArray]:
    """Return forces along and across thigh and shank, (n, 2) N each, when the wearer's leg moves as
    the machine does.

    ``torque`` (n, 2) is what the wearer's own leg takes at its angles ``q`` from the vertical;
    forces follow from the levers, the shank's first.
    """
    machine, leg = rig.machine, rig.person.leg
    thigh_lever, shank_lever = machine.cuff_distance
    weight = machine.carried * leg.gravity
    along_thigh = -weight * leg.thigh.mass * np.cos(q[:, 0])
    along_shank = -weight * leg.shank.mass * np.cos(q.sum(axis=1))
    across_shank = torque[:, 1] / shank_lever
    at_knee = across_shank * np.cos(q[:, 1]) + along_shank * np.sin(q[:, 1])
    across_thigh = (torque[:, 0] - torque[:, 1] - leg.length * at_knee) / thigh_lever
    return np.column_stack([along_thigh, along_shank]), np.column_stack(
        [across_thigh, across_shank]
    )
