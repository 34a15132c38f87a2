"""Sine and cosine of whole arrays, in a form that compiles to vector instructions."""

import math

import numpy as np
from numba import njit

VECTORIZED = {"reassoc", "contract", "nsz", "arcp"}
"""Permitted changes of arithmetic: reordered sums and fused operations, but no change of NaN or
infinity."""

# Taylor's series about 0, enough terms for 1e-15 on [-pi/2, pi/2].
_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(11))
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(12))
S0, S1, S2, S3, S4, S5, S6, S7, S8, S9, S10 = _SINE
C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10, C11 = _COSINE


@njit(cache=True, fastmath=VECTORIZED, error_model="numpy")
def sines(x, sine, cosine):
    """Write sin x and cos x; exact to 1e-14 for any joint angle.

    Parameters
    ----------
    x : (n,) array
        rad.
    sine, cosine : (n,) array
        Written.
    """
    for i in range(x.size):
        half_turns = np.floor(x[i] * (1.0 / math.pi) + 0.5)
        r = x[i] - math.pi * half_turns
        sign = 1.0 - 2.0 * (half_turns - 2.0 * np.floor(0.5 * half_turns))
        y = r * r
        odd = S7 + y * (S8 + y * (S9 + y * S10))
        odd = S0 + y * (S1 + y * (S2 + y * (S3 + y * (S4 + y * (S5 + y * (S6 + y * odd))))))
        even = C8 + y * (C9 + y * (C10 + y * C11))
        even = C0 + y * (
            C1 + y * (C2 + y * (C3 + y * (C4 + y * (C5 + y * (C6 + y * (C7 + y * even))))))
        )
        sine[i] = sign * r * odd
        cosine[i] = sign * even
