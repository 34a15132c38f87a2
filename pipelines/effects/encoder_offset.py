"""An encoder whose zero differs from the joint's."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import reading
from pipelines.mechanics.motion import Motion


class EncoderOffset(Effect):
    """The measured angle is the true one plus a constant.

    A joint that is zeroed at each start has another constant in each run.
    """

    name = "encoder_offset"
    title = "Encoder offset"
    side = Side.SENSOR
    family = Family.SENSOR
    resembles = ("angle", "other_angle", "both_angles")
    forms_differ = "a real zero may slip during a run"
    equation = "measured angle = true angle + offset"
    source = (
        "Hollerbach, Khalil, Gautier (2016), Springer Handbook of Robotics, ch. 6 (joint offset"
        " calibration)"
    )
    looks_like = (
        "gravity torque that leads or lags the angle: a residual like the cosine of the link's"
        " angle"
    )
    confirm = (
        "hold the links at angles known from a level or a stop, and read them; an encoder that is"
        " zeroed at each start reads zero wherever the joint hangs then: let it hang freely after"
        " a run, or home it on an index mark"
    )
    by_angle = True
    may_differ = "a joint that is zeroed at every start"
    shape = (Parameter("offset", "rad", "measured less true angle", "q_o", (-0.15, 0.15)),)

    @reading
    def reading(angle, values, joint):
        """Shift the angle."""
        angle[joint] += values[0]

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion with the true angle."""
        shift = np.zeros(len(motion.joints))
        shift[self.column(motion)] = shape[0]
        return motion.with_state(motion.q - shift, motion.dq, motion.ddq)
