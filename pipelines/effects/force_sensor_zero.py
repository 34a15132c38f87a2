"""Cuff force sensors that do not read zero without a load."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Parameter, Side
from pipelines.mechanics.motion import Motion


class ForceSensorZero(Effect):
    """Constant forces that the cuffs' sensors read, front and back sensor together.

    It is part of every model whose cuff forces are fitted, and no cause of a diagnosis.
    """

    name = "force_sensor_zero"
    title = "Force sensor zeros"
    side = Side.SENSOR
    equation = "knee: d_s F_sy; hip: d_t F_ty + d_s F_sy + L1 (F_sy cos q2 + F_sx sin q2)"
    source = "docs/contracts.md, recording/1: torque of the cuffs on the leg"
    whole_leg = True
    acts_in = ("with_human",)
    linear = (
        Parameter("shank_along", "N", "force along the shank at no load", "F_sx", (-50.0, 50.0)),
        Parameter("shank_across", "N", "force across the shank at no load", "F_sy", (-50.0, 50.0)),
        Parameter("thigh_across", "N", "force across the thigh at no load", "F_ty", (-50.0, 50.0)),
    )

    def cuff_columns(self, motion: Motion, columns: NDArray) -> NDArray:
        """Return the torque of unit forces about each joint.

        Parameters
        ----------
        motion : Motion
            n samples of hip and knee.
        columns : (n, 2, 3) array
            Gives the shape of the result.

        Returns
        -------
        (n, 2, 3) array
            N·m per N.
        """
        out = np.zeros_like(columns)
        geometry, knee = motion.geometry, motion.q[:, 1]
        thigh, shank = geometry.thigh_cuff_distance_m or 0.0, geometry.shank_cuff_distance_m or 0.0
        # The levers of `leg.cuff_torque`. A force along the thigh passes the hip's axis: no torque.
        out[:, 0, 0] = geometry.thigh_length_m * np.sin(knee)
        out[:, 0, 1] = shank + geometry.thigh_length_m * np.cos(knee)
        out[:, 1, 1] = shank
        out[:, 0, 2] = thigh
        return out
