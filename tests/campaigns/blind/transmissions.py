"""What is between a motor and its link, and between the machine and its wearer: springs, plays,
cuffs."""

from math import cos, exp

import numpy as np
from numpy.typing import NDArray

from tests.campaigns.blind.compiled import njit

RIGID, ELASTIC, WIND_UP, PLAY, PLAY_HERTZ = 0, 1, 2, 3, 4
PLAY_GREASED, PLAY_ROUNDED, SOFTENING = 5, 6, 7
GREASE = 0.02
"""Stiffness of what fills a play, as a share of that of the teeth."""
CUFF_CONSTANTS = 6


@njit()
def transmitted(kind, s, x, rate):
    """Torque of a transmission wound up by ``x``; ``s``: stiffness, damping, and the form's own."""
    if kind == ELASTIC:
        return s[0] * x * (1.0 + s[2] * x * x) + s[1] * rate
    if kind == SOFTENING:
        # A belt or a rubber coupling: full stiffness about zero, less the more it is wound up.
        return s[0] * x / (1.0 + abs(x) / s[2]) + s[1] * rate
    if kind == WIND_UP:
        # Harmonic drives: soft until the first torque step, then stiffer.
        soft = min(s[2], max(-s[2], x))
        return s[0] * soft + s[3] * s[0] * (x - soft) + s[1] * rate
    gap = 0.5 * s[2]
    if kind == PLAY_ROUNDED:
        # Teeth that give way gradually: the contact comes on over a tenth of the gap.
        depth = 0.1 * gap
        over = _soft_plus((x - gap) / depth) - _soft_plus((-x - gap) / depth)
        contact = min(1.0, abs(over))
        return s[0] * depth * over + s[1] * contact * rate
    if abs(x) <= gap:
        return GREASE * (s[0] * x + s[1] * rate) if kind == PLAY_GREASED else 0.0
    depth = abs(x) - gap
    side = 1.0 if x > 0 else -1.0
    if kind == PLAY_HERTZ:
        push = s[0] * 12.0 * depth**1.5 + s[1] * side * rate * min(1.0, depth / 1e-3)
    elif kind == PLAY_GREASED:
        return side * (s[0] * (depth + GREASE * gap)) + s[1] * rate
    else:
        push = s[0] * depth + s[1] * side * rate
    return side * max(0.0, push)


@njit()
def _soft_plus(x):
    return x if x > 30.0 else np.log1p(exp(x)) if x > -30.0 else 0.0


def per_metre(cuffs: NDArray, levers: NDArray) -> NDArray:
    """Return cuffs by the metre of a cuff's way, from those by angles about their joints, (2, 6) as
    ``Plan.cuffs``.

    Columns: stiffness, damping, hardening, slack, relaxing share, relaxation time.
    """
    result = cuffs.copy()
    result[:, :3] /= levers[:2, np.newaxis] ** 2
    result[:, 3] *= levers[:2]
    return result


@njit()
def press(cuffs, levers, q, v, hq, hv, memory, dt, force, own, pressed):
    """Let the machine's cuffs push the wearer's leg, and note the forces across thigh and shank.

    ``memory`` (2,) holds the ways to which the cuffs have crept.
    """
    thigh, shank, length = levers
    bend = length * cos(q[1])
    hip, knee = q[0] - hq[0], q[1] - hq[1]
    hip_rate, knee_rate = v[0] - hv[0], v[1] - hv[1]
    for i in range(2):
        way = thigh * hip if i == 0 else bend * hip + shank * (hip + knee)
        rate = thigh * hip_rate if i == 0 else bend * hip_rate + shank * (hip_rate + knee_rate)
        if cuffs[i, 5] > 0.0:
            memory[i] += dt / cuffs[i, 5] * (cuffs[i, 4] * way - memory[i])
        stretch = way - memory[i]
        slack = cuffs[i, 3]
        if slack > 0.0:
            # A strap that has room: a tenth of its stiffness until it is taut.
            loose = min(slack, max(-slack, stretch))
            stretch = stretch - 0.9 * loose
        pressed[i] = (
            cuffs[i, 0] * stretch * (1.0 + cuffs[i, 2] * stretch * stretch) + cuffs[i, 1] * rate
        )
    at_hip = thigh * pressed[0] + (bend + shank) * pressed[1]
    at_knee = shank * pressed[1]
    own[0] += at_hip
    own[1] += at_knee
    force[0] -= at_hip
    force[1] -= at_knee
