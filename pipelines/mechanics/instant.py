"""The state of a machine at one instant, and the compilation of torque equations.

A kernel is written once for all users: it is evaluated along a measured motion, and at every
integration step of the forward dynamics. All kernels of a kind share one signature, so that
compiled code can hold them by address.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.core.types import float64, int64, void

vector = float64[::1]

REFERENCE_C = 25.0
"""Temperature, °C, to which temperature effects refer, and the default of simulations."""


class Instant(NamedTuple):
    """The machine at one instant; every array is (J,) in SI units.

    ``direction`` is the sign of the velocity while a joint moves. While it sticks, the forward
    dynamics sets the value in [-1, 1] that holds it. Equations use it in place of sgn v. ``load``
    is the torque that the drive train transmits to the link, N·m; ``temperature`` is that of the
    motors in °C, NaN where it was not measured.
    """

    t: float
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    direction: np.ndarray
    load: np.ndarray
    temperature: np.ndarray


# Explicit signatures need this type before any kernel is called.
INSTANT = types.NamedTuple([float64, *(vector,) * 6], Instant)

REACTION = void(INSTANT, vector, vector, vector, int64, vector)
"""reaction(at, state, values, geometry, joint, out): add the drives' torque to ``out``."""


def compiler_of(signature):
    """Return a decorator that compiles a kernel, which stands in its class without ``self``."""
    return lambda function: staticmethod(njit(signature, cache=True)(function))


reaction = compiler_of(REACTION)
"""Decorator of a torque equation."""
