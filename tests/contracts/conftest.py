import numpy as np
import pandas as pd
import pytest

RUN = {"run": "exo_alone", "purpose": "train", "sample_rate_hz": 200}


@pytest.fixture
def swinging_leg() -> pd.DataFrame:
    """Half a second of a leg that swings, as a recording's frame."""
    time = np.arange(100) * 0.005
    return pd.DataFrame(
        {
            "time_s": time,
            "hip_angle_rad": 0.4 * np.sin(time),
            "knee_angle_rad": -0.5 + 0.3 * np.cos(time),
            "hip_torque_nm": 10 * np.cos(time),
            "knee_torque_nm": 3 * np.sin(time),
        }
    )


@pytest.fixture
def run_metadata() -> dict:
    return dict(RUN)
