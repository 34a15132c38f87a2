from dataclasses import replace

import numpy as np
import pytest

from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.motion import Motion

# Three harmonics that move both joints both ways through most of their range, from no design
# program.
RICH = FourierTrajectory(
    omega=0.2 * np.pi,
    theta0=np.array([0.45, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
)


@pytest.fixture(scope="session")
def with_human():
    """One period with exact derivatives, under a torque that changes sign and from motors that
    warm."""
    time = np.arange(0.0, 10.0, 0.005)
    q, dq, ddq = RICH.at(time)
    torque = 25.0 * np.sin(q) + 4.0 * ddq
    everywhere = np.ones(len(time), dtype=bool)
    temperature = np.column_stack([26.0 + 0.5 * time, 28.0 + 0.8 * time])
    return Motion(
        time,
        q,
        dq,
        ddq,
        torque,
        np.zeros(len(time), dtype=np.int64),
        everywhere,
        run="with_human",
        temperature=temperature,
    )


@pytest.fixture(scope="session")
def exo_alone(with_human):
    return replace(with_human, run="exo_alone")
