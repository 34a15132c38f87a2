"""A gait-like reference: hip and knee swing at half a stride per second."""

import numpy as np

from pipelines.mechanics.fourier import FourierTrajectory

OMEGA = np.pi
"""Angular frequency, rad/s: one stride in two seconds."""

MEAN = np.array([0.18, -0.46])
"""Mean angle of hip and knee, rad."""

AMPLITUDE = np.array([[0.40, -0.06, 0.0], [-0.28, -0.24, -0.06]])
PHASE = np.array([[-0.2, 0.6, 0.0], [1.8, 2.6, 3.0]])
"""Phase of the cosine of each harmonic, joint x harmonic, rad."""


def gait() -> FourierTrajectory:
    """Return the reference case of docs/simulation.md.

    q = mean + sum over k of amplitude_k cos(k w t + phase_k).

    Returns
    -------
    FourierTrajectory
        Of hip and knee, rad and s.
    """
    # From cos(x + p) = cos p cos x - sin p sin x.
    return FourierTrajectory(
        theta0=MEAN, a=-AMPLITUDE * np.sin(PHASE), b=AMPLITUDE * np.cos(PHASE), omega=OMEGA
    )
