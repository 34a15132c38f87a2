"""Sine and cosine of whole arrays, in a form that compiles to vector instructions."""

import math
from typing import Any

import numpy as np
from numba import njit

FAST: dict[str, Any] = {
    "cache": True,
    "fastmath": {"reassoc", "contract", "nsz", "arcp"},
    "error_model": "numpy",
}
"""Compiler options of vector instructions: sums may be reordered and operations fused, but NaN and
infinity stay as they are."""

SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(11))
COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(12))
"""Taylor's series about 0, enough terms for 1e-15 on [-pi/2, pi/2]."""


@njit(**FAST)
def sines(x, sine, cosine):
    """Write sin x and cos x; exact to 1e-14 for any joint angle.

    Parameters
    ----------
    x : (n,) array
        rad.
    sine, cosine : (n,) array
        Written.
    """
    s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10 = SINE
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11 = COSINE
    for i in range(x.size):
        # Reduction to [-pi/2, pi/2]. Each half turn changes both signs; a branch would prevent
        # vector instructions.
        half_turns = np.floor(x[i] * (1.0 / math.pi) + 0.5)
        r = x[i] - math.pi * half_turns
        sign = 1.0 - 2.0 * (half_turns - 2.0 * np.floor(0.5 * half_turns))
        y = r * r
        odd = s7 + y * (s8 + y * (s9 + y * s10))
        odd = s0 + y * (s1 + y * (s2 + y * (s3 + y * (s4 + y * (s5 + y * (s6 + y * odd))))))
        even = c8 + y * (c9 + y * (c10 + y * c11))
        even = c0 + y * (
            c1 + y * (c2 + y * (c3 + y * (c4 + y * (c5 + y * (c6 + y * (c7 + y * even))))))
        )
        sine[i] = sign * r * odd
        cosine[i] = sign * even
