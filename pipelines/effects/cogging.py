"""Torque that repeats with the angle."""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class Cogging(Effect):
    """Magnets against slots, teeth against teeth: a ripple fixed to the joint's angle."""

    name = "cogging"
    title = "Cogging"
    side = Side.DRIVE
    family = Family.ANGLE
    resembles = ("angle",)
    forms_differ = "a real ripple may differ forward and back, and grow with the load"
    equation = "tau = A sin(n q) + B cos(n q)"
    source = "Holtz, Springob (1996), IEEE Trans. Industrial Electronics 43(2); Tuttle, Seering (1996), T-RA 12(3)"
    looks_like = "residual against angle: a wave that is the same forward and backward"
    confirm = "move the joint slowly and evenly, plot torque against where it is, and count the waves"
    linear = (
        Parameter("sine", "N·m", "amplitude of sin(n q)", "A", (-4.0, 4.0)),
        Parameter("cosine", "N·m", "amplitude of cos(n q)", "B", (-4.0, 4.0)),
    )
    shape = (Parameter("cycles_per_turn", "1/turn", "waves in a turn of the joint", "n", (4.0, 120.0)),)
    reported = (
        Parameter("amplitude", "N·m", "half of peak to peak", "A", (0.3, 4.0)),
        *shape,
        Parameter("phase", "rad", "of the wave at angle zero", "phi", (-np.pi, np.pi), of_joint=False),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add A sin(n q) + B cos(n q) at the joint."""
        angle = values[2] * at.q[joint]
        out[joint] += values[0] * sin(angle) + values[1] * cos(angle)

    def physical(self, values: NDArray) -> NDArray:
        """Return amplitude, cycles per turn and phase of amplitude sin(n q + phase)."""
        sine, cosine, cycles = values
        return np.array([np.hypot(sine, cosine), cycles, np.arctan2(cosine, sine)])

    def values_from(self, physical: NDArray) -> NDArray:
        """Return the amplitudes of sine and cosine, and the cycles per turn."""
        amplitude, cycles, phase = physical
        return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase), cycles])
