"""A gait-like reference: hip and knee swing at half a stride per second."""

import numpy as np

from pipelines.mechanics.fourier import FourierTrajectory


def gait() -> FourierTrajectory:
    """Return the reference case of docs/simulation.md.

    q = mean + sum over k of amplitude_k cos(k w t + phase_k).

    Returns
    -------
    FourierTrajectory
        Of hip and knee, rad and s.
    """
    # Of hip and knee and each harmonic, rad.
    amplitude = np.array([[0.40, -0.06, 0.0], [-0.28, -0.24, -0.06]])
    phase = np.array([[-0.2, 0.6, 0.0], [1.8, 2.6, 3.0]])
    # From cos(x + p) = cos p cos x - sin p sin x. A stride takes two seconds.
    return FourierTrajectory(
        theta0=np.array([0.18, -0.46]),
        a=-amplitude * np.sin(phase),
        b=amplitude * np.cos(phase),
        omega=np.pi,
    )
