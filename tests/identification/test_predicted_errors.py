"""The standard errors that a design predicts are those of an identification."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.contracts.table import Table
from pipelines.design.excitation import design
from pipelines.design.quality import standard_errors
from pipelines.identification import identify
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.design import DesignSettings, NoiseSettings
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings

NOISE = NoiseSettings()
SESSIONS = 200
"""The scatter of so many fits is known to 5 %."""


def noisy(motion, seed):
    rho = np.exp(-1.0 / (motion.sample_rate_hz * NOISE.correlation_s))
    white = np.random.default_rng(seed).standard_normal((len(motion) + 200, 2))
    noise = lfilter([np.sqrt(1 - rho**2)], [1, -rho], white, axis=0)[200:] * [
        NOISE.hip_nm,
        NOISE.knee_nm,
    ]
    return replace(motion, torque=motion.torque + noise)


def recorded(trajectory, purpose):
    plant = Plant(PlantSettings(ripple_nm=(0.0, 0.0)), "exo_alone", seed=0)
    frame, metadata = record(plant, trajectory, NOISE.duration_s, purpose)
    return motion_from_table(motion_table(Table(frame, metadata), FilterSettings()))


@pytest.mark.slow
def test_foretold_standard_errors_are_the_scatter_of_identifications():
    trajectory = design(DesignSettings(seed=1)).trajectory
    train, validate = recorded(trajectory, "train"), recorded(trajectory, "validate")
    foretold = standard_errors(trajectory, NOISE, train.geometry, train.sample_rate_hz)
    tables = [identify([noisy(train, seed), validate]).parameters for seed in range(SESSIONS)]
    scatter = np.std([table["value"] for table in tables], axis=0)
    said = np.mean([table["std_error"] for table in tables], axis=0)
    print(
        f"\nover the scatter {np.round(foretold / scatter, 2)}, over the fit's own"
        f" {np.round(foretold / said, 2)}"
    )
    np.testing.assert_allclose(foretold, scatter, rtol=0.2)
    np.testing.assert_allclose(foretold, said, rtol=0.2)
