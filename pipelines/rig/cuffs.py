"""Forces in the cuffs, through which the exoskeleton's torque acts on the leg."""

import numpy as np
from numpy.typing import NDArray

from pipelines.settings.rig.plant import PlantSettings


def cuff_forces(human_torque: NDArray, q: NDArray, plant: PlantSettings) -> NDArray:
    """Return the forces on the four sensors without error.

    This is the inverse of ``mechanics.mechanisms.leg.cuff_torque``. Two assumptions make it unique:
    along its axis each limb carries a share of its weight, and across it cuffs press but never
    pull.

    Parameters
    ----------
    human_torque : (n, 2) array
        Torque of the exoskeleton on the leg, N·m about hip and knee.
    q : (n, 2) array
        Angles of the links, rad.

    Returns
    -------
    (n, 4, 3) array
        x, y, z, N, at thigh front, thigh back, shank front and shank back.
    """
    cuff = plant.cuff
    # The x axis points away from the hip, along gravity in a hanging leg. So a carried weight is
    # negative.
    shank_x = -cuff.carried_share * cuff.shank_weight_n * np.cos(q[:, 0] + q[:, 1])
    shank_y = human_torque[:, 1] / plant.shank_cuff_distance_m
    # The shank's force also turns the thigh about the hip, by its part across the thigh, at the
    # knee.
    at_knee = shank_y * np.cos(q[:, 1]) + shank_x * np.sin(q[:, 1])
    about_hip = human_torque[:, 0] - human_torque[:, 1] - plant.thigh_length_m * at_knee
    thigh_y = about_hip / plant.thigh_cuff_distance_m
    thigh_x = -cuff.carried_share * cuff.thigh_weight_n * np.cos(q[:, 0])
    forces = np.zeros((len(q), 4, 3))
    for first, along, across in ((0, thigh_x, thigh_y), (2, shank_x, shank_y)):
        # Lateral forces remain zero: the leg moves in a plane.
        forces[:, first : first + 2, 0] = along[:, np.newaxis] / 2
        # Front and back add up to `across`. The front never exceeds 0, and the back never falls
        # below it. At rest each has the preload.
        squeeze = np.hypot(across / 2, cuff.preload_n)
        forces[:, first, 1] = across / 2 - squeeze
        forces[:, first + 1, 1] = across / 2 + squeeze
    return forces
