"""Bounds beyond which a length or the gravity was given in another unit."""

MOST_GRAVITY_M_S2 = 30.0
"""More than on any planet; 9.81 m/s² in cm/s² is beyond it."""

MOST_LENGTH_M = 5.0
"""More than any limb or machine for one; 389.52 mm and 38.952 cm are beyond it."""
