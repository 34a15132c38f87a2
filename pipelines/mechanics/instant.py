"""What a torque equation sees of a machine at one instant, and how it is compiled.

A kernel is written once and used by everybody: along a measured motion, and at every integration
step of the forward dynamics. All of a kind share one signature, so that compiled code can hold them
by their address.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.core.types import float64, int64, void

vector = float64[::1]

REFERENCE_C = 25.0
"""°C at which what depends on temperature is told, and at which a simulation runs that is told no
other."""


class Instant(NamedTuple):
    """The machine at one instant, every array (J,) and in SI units.

    ``direction`` is the sign of the velocity where a joint moves; where it sticks, the forward
    dynamics puts the value in [-1, 1] that holds it. Equations use it wherever theirs says sgn v.
    ``load`` is the torque that the drive train transmits to the link, N·m; ``temperature`` is the
    motors', °C, NaN where it was not read.
    """

    t: float
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    direction: np.ndarray
    load: np.ndarray
    temperature: np.ndarray


INSTANT = types.NamedTuple([float64, *(vector,) * 6], Instant)

REACTION = void(INSTANT, vector, vector, vector, int64, vector)
"""reaction(at, state, values, geometry, joint, out): add the torque the drives must supply to
``out``."""


def reaction(function):
    """Compile a torque equation."""
    return staticmethod(njit(REACTION, cache=True)(function))
