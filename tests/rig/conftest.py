import numpy as np
import pytest

from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.settings.rig.plant import CuffSettings, PlantSettings


@pytest.fixture
def excitation():
    """Both joints, two harmonics, well within the limits, never both at rest."""
    a, b = np.array([[0.2, -0.12], [0.1, -0.1]]), np.array([[0.05, 0.1], [0.15, 0.05]])
    return FourierTrajectory(np.array([0.6, -0.9]), a, b, omega=np.pi)


@pytest.fixture
def silent():
    """A plant whose sensors make no error."""
    return PlantSettings(
        ripple_nm=(0.0, 0.0), counts_per_turn=(0.0, 0.0), cuff=CuffSettings(noise_n=0.0)
    )
