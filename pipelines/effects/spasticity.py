"""A stretch reflex."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import reaction


class Spasticity(Effect):
    """Muscle that resists a stretch faster than its threshold, in one direction."""

    name = "spasticity"
    title = "Spasticity"
    side = Side.HUMAN
    family = Family.PERSON
    resembles = ("speed",)
    forms_differ = "a real reflex comes some 40 ms late, and its threshold depends on the angle"
    equation = "tau = gain (v - v0) beyond v0 on the side of v0's sign, else 0"
    source = (
        "Lance (1980), in Spasticity: Disordered Motor Control; Falisse et al. (2018), PLoS ONE"
        " 13(12)"
    )
    looks_like = (
        "residual against speed: flat, then a ramp beyond a speed, one way only and only with the"
        " human"
    )
    confirm = (
        "stretch the relaxed leg at several speeds: the torque jumps at the fast ones (Tardieu's"
        " test)"
    )
    acts_in = ("with_human",)
    linear = (
        Parameter("gain", "N·m·s/rad", "torque per speed beyond the threshold", "G", (1.0, 20.0)),
    )
    shape = (
        Parameter(
            "threshold_velocity",
            "rad/s",
            "speed from which it acts; its sign is the direction",
            "v0",
            (-1.5, 1.5),
        ),
    )
    reported = (
        linear[0],
        Parameter("threshold_velocity", "rad/s", "speed from which it acts", "|v0|", (0.05, 1.5)),
        Parameter(
            "direction",
            "1",
            "direction in which it acts: 1 or -1",
            "sgn v0",
            (-1.0, 1.0),
            default=1.0,
        ),
    )
    dissipative = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add gain (v - v0) beyond the threshold."""
        excess = at.dq[joint] - values[1]
        # Faster than the threshold, and in its direction.
        if excess * values[1] > 0.0:
            out[joint] += values[0] * excess

    def physical(self, values: NDArray) -> NDArray:
        """Return gain, size and direction of the threshold, (3,)."""
        gain, threshold = values
        return np.array([gain, abs(threshold), 1.0 if threshold >= 0 else -1.0])

    def values_from(self, physical: NDArray) -> NDArray:
        """Return gain and signed threshold, (2,)."""
        gain, speed, direction = physical
        return np.array([gain, speed if direction >= 0 else -speed])
