"""Hidden dry friction: what it adds to the level that opposes motion forward and backward.

Each form is a number, its parameters ``p``, and a line in ``dry_levels``. Sources: Armstrong-Helouvry,
Dupont, Canudas de Wit (1994), Automatica 30(7) for the Stribeck shapes.
"""

from math import exp, sin, sqrt, tanh

from numba import njit

STRIBECK_GAUSS, STRIBECK_LORENTZ, STRIBECK_EXPONENTIAL = 1, 2, 3
ASYMMETRY, ASYMMETRY_SMOOTH = 4, 5
LOAD_LINEAR, LOAD_ROOT, LOAD_OFFSET = 7, 8, 9
WARMUP_EXPONENTIAL, WARMUP_POWER = 10, 11
OTHER_JOINT = 12
LAST_DRY, FIRST_DRY_AGAIN = 19, 100
"""Numbers up to the one and from the other on are dry friction, those between them are smooth torques."""


@njit(cache=True)
def is_dry(kind):
    """Tell whether a kind of hidden torque is dry friction."""
    return kind <= LAST_DRY or kind >= FIRST_DRY_AGAIN


@njit(cache=True)
def dry_levels(kind, p, table, t, j, angle, other_angle, speed, load):
    """Levels added forward and backward at joint ``j``, N·m.

    ``angle`` is the joint's own, ``speed`` and ``load`` (the torque passed on to the link) are of both joints.
    """
    v = abs(speed[j])
    level = 0.0
    if kind == STRIBECK_GAUSS:
        level = p[0] * exp(-((v / p[1]) ** 2))
    elif kind == STRIBECK_LORENTZ:
        level = p[0] / (1.0 + (v / p[1]) ** 2)
    elif kind == STRIBECK_EXPONENTIAL:
        level = p[0] * exp(-v / p[1])
    elif kind == ASYMMETRY:
        return p[0], -p[0]
    elif kind == ASYMMETRY_SMOOTH:
        return p[0] * tanh(v / p[1]), -p[0] * tanh(v / p[1])
    elif kind == LOAD_LINEAR:
        level = p[0] * abs(load[j])
    elif kind == LOAD_ROOT:
        level = p[0] * sqrt(abs(load[j]) * p[1])
    elif kind == LOAD_OFFSET:
        level = p[0] * max(0.0, abs(load[j]) - p[1])
    elif kind == WARMUP_EXPONENTIAL:
        level = p[0] * exp(-max(t, 0.0) / p[1])
    elif kind == WARMUP_POWER:
        level = p[0] / (1.0 + max(t, 0.0) / p[1])
    elif kind == OTHER_JOINT:
        level = p[0] * (1.0 + sin(p[1] * other_angle + p[2]))
    return level, level
