"""Readings of encoders: an offset, and errors once, twice and three times a turn."""

from math import cos, sin

from tests.campaigns.blind.compiled import njit

WAVES = 3


@njit()
def reading(offset, wobble, theta):
    """Return the reading of an angle; ``wobble`` (6,) has amplitude and phase of each wave."""
    angle = theta + offset + wobble[0] * sin(theta + wobble[1])
    for k in range(1, WAVES):
        if wobble[2 * k] != 0.0:
            angle += wobble[2 * k] * sin((k + 1) * theta + wobble[2 * k + 1])
    return angle


@njit()
def slope(wobble, theta):
    """Return the factor of a measured speed."""
    factor = 1.0
    for k in range(WAVES):
        if wobble[2 * k] != 0.0:
            factor += (k + 1) * wobble[2 * k] * cos((k + 1) * theta + wobble[2 * k + 1])
    return factor


@njit()
def curvature(wobble, theta):
    """Return how that factor changes with the angle, 1/rad."""
    factor = 0.0
    for k in range(WAVES):
        if wobble[2 * k] != 0.0:
            factor -= (k + 1) ** 2 * wobble[2 * k] * sin((k + 1) * theta + wobble[2 * k + 1])
    return factor
