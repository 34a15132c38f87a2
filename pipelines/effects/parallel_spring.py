"""A spring beside the drive."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class ParallelSpring(Effect):
    """A torque in proportion to the joint's angle: a balancing spring, a cable, a cover."""

    name = "parallel_spring"
    title = "Parallel spring"
    side = Side.STRUCTURE
    equation = "tau = k (q - q0) = k q - b"
    source = "Wang, van Dijk, van der Kooij (2011), ICORR: spring uses in exoskeleton actuation design"
    looks_like = "residual against angle: a straight line, the same both ways; partly hidden in gravity and friction"
    confirm = "lay the machine on its side, so that gravity is out, and hold the joint at several angles"
    linear = (
        Parameter("stiffness", "N·m/rad", "torque per angle", "k", (2.0, 40.0)),
        Parameter("preload", "N·m", "stiffness times rest angle", "b", (-30.0, 30.0)),
    )
    reported = (
        linear[0],
        Parameter("rest_angle", "rad", "angle at which it pulls neither way", "q0", (-1.0, 1.0)),
    )  # fmt: skip
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add k q - b at the joint."""
        out[joint] += values[0] * at.q[joint] - values[1]

    def physical(self, values: NDArray) -> NDArray:
        """Return stiffness and rest angle; without stiffness there is no rest angle."""
        stiffness, preload = values
        return np.array([stiffness, preload / stiffness if stiffness != 0.0 else np.nan])

    def values_from(self, physical: NDArray) -> NDArray:
        """Return stiffness and preload."""
        stiffness, rest_angle = physical
        return np.array([stiffness, stiffness * rest_angle])
