from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.table import Table
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings

# Torque is recorded without its noise: each test adds noise of its own colour.
PLANT = PlantSettings(ripple_nm=(0.0, 0.0))

# Three harmonics that move both joints through most of their range, from no design program.
RICH = FourierTrajectory(
    omega=0.2 * np.pi,
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
)


@pytest.fixture(scope="session")
def noiseless_motions():
    """Four runs of 40 s of a faultless machine, torque as the drives applied it."""
    motions = []
    for run in ("exo_alone", "with_human"):
        for seed, purpose in enumerate(("train", "validate")):
            frame, metadata = record(Plant(PLANT, run, seed=seed), RICH, 40.0, purpose)
            motion = motion_from_table(motion_table(Table(frame, metadata), FilterSettings()))
            motions.append(replace(motion, file=f"{run}_{purpose}.parquet"))
    return motions


@pytest.fixture(scope="session")
def truth():
    """True values in the order of the rows of ``parameters/1``."""
    exo, human = np.array(PLANT.exo_inertial), np.array(PLANT.human_inertial)
    friction = np.column_stack([PLANT.coulomb_nm, PLANT.viscous_nm_s_rad]).ravel()
    return np.concatenate([exo, friction, exo + human, human])
