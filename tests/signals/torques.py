"""Torques for tests of what a channel shows."""

import numpy as np


def torque(rng, seconds, noise=0.0, friction=0.0):
    """Return a torque of about 10 N·m that crosses zero, in steps of 0.01 N·m."""
    speed, *phases = rng.uniform([3.0, 0.0, 0.0, 0.0], [12.0, 6.0, 6.0, 6.0])
    values = 10.0 * np.sin(speed * seconds + phases[0])
    values += 3.0 * np.sin(2.3 * speed * seconds + phases[1])
    values += friction * np.sign(np.cos(speed * seconds + phases[2]))
    return np.round(values + rng.normal(0.0, noise, len(seconds)), 2)
