"""Hidden dry friction: what it adds to the level that opposes motion forward and backward.

Each form is a number, its parameters ``p``, and a line in ``dry_levels``. Sources:
Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7) for the Stribeck shapes.
"""

from math import exp, sin, sqrt, tanh

from tests.campaigns.blind.compiled import njit
from tests.campaigns.blind.further_torques import table_at, warming

STRIBECK_GAUSS, STRIBECK_LORENTZ, STRIBECK_EXPONENTIAL = 1, 2, 3
ASYMMETRY, ASYMMETRY_SMOOTH = 4, 5
LOAD_LINEAR, LOAD_ROOT, LOAD_OFFSET = 7, 8, 9
WARMUP_EXPONENTIAL, WARMUP_POWER = 10, 11
OTHER_JOINT = 12
STRIBECK_STRETCHED, STRIBECK_HYPERBOLIC = 100, 101
ASYMMETRY_RATIONAL, ASYMMETRY_LOADED = 102, 103
LOAD_QUADRATURE, LOAD_SATURATING = 104, 105
WARMUP_TWO, WARMUP_LATE, LEVEL_TABLE = 106, 107, 108
POSITION_LINEAR, POSITION_SINE, POSITION_PATCH = 109, 110, 111
OTHER_LOAD, LOAD_LOPSIDED = 112, 113
LAST_DRY, FIRST_DRY_AGAIN = 19, 100
"""Numbers up to the one and from the other on are dry friction, those between them are smooth
torques."""


@njit()
def is_dry(kind):
    """Return whether a kind of hidden torque is dry friction."""
    return kind <= LAST_DRY or kind >= FIRST_DRY_AGAIN


@njit()
def dry_levels(kind, p, table, t, j, angle, other_angle, speed, load):
    """Levels added forward and backward at joint ``j``, N·m.

    ``angle`` is the joint's own, ``speed`` and ``load`` (the torque passed on to the link) are of
    both joints.
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
    elif kind >= FIRST_DRY_AGAIN:
        return _further_levels(kind, p, table, t, j, angle, speed, load)
    return level, level


@njit()
def _further_levels(kind, p, table, t, j, angle, speed, load):
    """Return the levels of the forms that the first examinations did not have."""
    v, level = abs(speed[j]), 0.0
    if kind == STRIBECK_STRETCHED:
        level = p[0] * exp(-((v / p[1]) ** p[2]))
    elif kind == STRIBECK_HYPERBOLIC:
        level = p[0] * (1.0 - tanh(v / p[1]))
    elif kind == ASYMMETRY_RATIONAL:
        level = p[0] * v / (v + p[1])
        return level, -level
    elif kind == ASYMMETRY_LOADED:
        level = p[0] * sqrt(1.0 + (load[j] / p[1]) ** 2)
        return level, -level
    elif kind == LOAD_QUADRATURE:
        level = p[0] * (sqrt(load[j] * load[j] + p[1] * p[1]) - p[1])
    elif kind == LOAD_SATURATING:
        level = p[0] * abs(load[j]) / (1.0 + abs(load[j]) / p[1])
    elif kind in (WARMUP_TWO, WARMUP_LATE):
        level = p[0] * warming(kind == WARMUP_LATE, p[1], p[2], max(t, 0.0))
    elif kind == LEVEL_TABLE:
        level = p[0] * table_at(table, t)
    elif kind == POSITION_LINEAR:
        level = p[0] * min(1.0, max(0.0, 0.5 + p[3] * (angle - p[1]) / p[2]))
    elif kind == POSITION_SINE:
        level = p[0] * 0.5 * (1.0 + sin(p[2] * (angle - p[1])))
    elif kind == POSITION_PATCH:
        level = p[0] * exp(-(((angle - p[1]) / p[2]) ** 2))
    elif kind == OTHER_LOAD:
        level = p[0] * abs(load[1 - j])
    elif kind == LOAD_LOPSIDED and load[j] * speed[j] > 0.0:
        # A gear that loses a share where it drives, and nothing where it is driven.
        level = p[0] * abs(load[j])
    return level, level
