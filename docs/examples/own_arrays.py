"""Identify a pendulum from arrays: write recordings of them, filter, fit."""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from pipelines.contracts import RECORDING
from pipelines.identification import identify
from pipelines.mechanics.read import read_motions
from pipelines.settings.filter import FilterSettings

RATE_HZ = 500.0
INERTIA, MOMENT, COULOMB, VISCOUS = 0.08, 0.30, 0.15, 0.05  # kg·m², kg·m, N·m, N·m·s/rad: the truth


def swing(seed: int) -> pd.DataFrame:
    """Return 20 s of a driven pendulum as any logger might hold it."""
    noise = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    w = 2 * np.pi * 0.2 * np.arange(1, 4)[:, np.newaxis]
    phase = noise.uniform(0.0, 2 * np.pi, (3, 1))
    size = np.array([[0.7], [0.4], [0.2]])
    q = np.sum(size * np.sin(w * t + phase), axis=0)
    dq = np.sum(size * w * np.cos(w * t + phase), axis=0)
    ddq = -np.sum(size * w**2 * np.sin(w * t + phase), axis=0)
    torque = INERTIA * ddq + 9.81 * MOMENT * np.sin(q) + COULOMB * np.sign(dq) + VISCOUS * dq
    return pd.DataFrame(
        {
            "time_s": t,
            "pivot_angle_rad": q + noise.normal(0.0, 1e-4, len(t)),
            "pivot_torque_nm": torque + noise.normal(0.0, 0.02, len(t)),
        }
    )


with tempfile.TemporaryDirectory() as folder:
    files = []
    for seed, purpose in enumerate(("train", "validate")):
        files.append(Path(folder) / f"{purpose}.parquet")
        about = {
            "run": "exo_alone",
            "purpose": purpose,
            "sample_rate_hz": RATE_HZ,
            "joints": [{"name": "pivot", "kind": "revolute"}],
            "geometry": {"gravity_m_s2": 9.81},
        }
        # What breaks the contract is refused here, with file, column and row.
        RECORDING.write(files[-1], swing(seed), about)
    result = identify(read_motions(files, FilterSettings()))

table = result.parameters[["name", "joint", "value", "ci95_low", "ci95_high", "unit"]]
print(table.to_string(index=False))
print(f"torque error on the run no fit has seen: {result.validation.pooled.rmse[0]:.4f} N·m")

truth = np.array([INERTIA, MOMENT, COULOMB, VISCOUS])
assert np.allclose(result.parameters["value"], truth, rtol=0.05)
