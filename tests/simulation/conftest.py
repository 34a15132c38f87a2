"""Legs to simulate: the paper's Table 3, a lighter one, and a recording of it made by its own
drives."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts import HIP_AND_KNEE, PARAMETERS, RECORDING
from pipelines.dynamics.pd_loop import follow, loop_at_rest, make_drives
from pipelines.dynamics.plant import Plant, make_plant
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.mechanics.geometry import Geometry
from pipelines.model import Model, Term

TABLE3 = ((10.3016, 3.0157, 2.2664, 5.5354), (2.6596, 4.14895), (4.7197, 7.3602))
"""Paper, Table 3: X1..X4; Ks and Km of hip and of knee."""
LIGHT = ((2.6, 0.63, 1.78, 5.7), (3.0, 4.0), (2.0, 3.0))
"""DESIGN section 3: an 88 kg adult's leg with such an exoskeleton."""

RATE_HZ = 200.0
KP, KD, LIMIT = (1500.0, 600.0), (120.0, 40.0), (200.0, 200.0)
NAMES = ("hip", "knee")


def leg(X, hip, knee) -> Model:
    frictions = (
        Term(Friction(name), np.array(values))
        for name, values in zip(NAMES, (hip, knee), strict=True)
    )
    return Model((Term(RigidBody(), np.array(X)), *frictions))


@pytest.fixture
def table3() -> Plant:
    return make_plant(leg(*TABLE3), Geometry(), HIP_AND_KNEE, "with_human")


@pytest.fixture
def light() -> Plant:
    return make_plant(leg(*LIGHT), Geometry(), HIP_AND_KNEE, "with_human")


def rows_of(values, run: str, causes=()) -> pd.DataFrame:
    X, hip, knee = values
    rows = [
        ("rigid_body", f"X{i + 1}", f"X{i + 1}", None, run, x, "kg·m²") for i, x in enumerate(X)
    ]
    for joint, pair in zip(NAMES, (hip, knee), strict=True):
        rows += [
            ("friction", name, symbol, joint, None, value, "N·m")
            for name, symbol, value in zip(("coulomb", "viscous"), ("Ks", "Km"), pair, strict=True)
        ]
    for term in causes:
        effect = term.effect
        rows += [
            (effect.name, p.name, p.symbol, effect.joint, None, value, p.unit)
            for p, value in zip(effect.parameters, effect.physical(term.values), strict=True)
        ]
    frame = pd.DataFrame(
        rows, columns=["effect", "name", "symbol", "joint", "run", "value", "unit"]
    )
    return frame.assign(std_error=0.1, ci95_low=0.0, ci95_high=1.0, step="inertia")


@pytest.fixture
def parameters_file(tmp_path) -> Callable[..., Path]:
    """Write a parameters/1 file."""

    def write(values=TABLE3, run="with_human", causes=(), **metadata) -> Path:
        path, geometry = (
            tmp_path / "parameters.parquet",
            {"thigh_length_m": 0.38952, "gravity_m_s2": 9.8},
        )
        frame = rows_of(values, run, causes)
        own = {(t.effect.name, p.name) for t in causes for p in t.effect.parameters if p.per_run}
        frame["each_run"] = [row in own for row in zip(frame["effect"], frame["name"], strict=True)]
        PARAMETERS.write(path, frame, {"geometry": geometry} | metadata)
        return path

    return write


def excitation(time):
    """A reference that both joints follow without sticking for long, (n, 2) rad."""
    hip = 0.6 + 0.35 * np.sin(2 * np.pi * 0.2 * time) + 0.1 * np.cos(2 * np.pi * 0.5 * time)
    knee = -0.9 + 0.4 * np.sin(2 * np.pi * 0.3 * time + 1.0) + 0.1 * np.cos(2 * np.pi * 0.6 * time)
    return np.column_stack([hip, knee])


@pytest.fixture(scope="session")
def driven() -> dict[str, np.ndarray]:
    """The light leg for 20 s under its PD drives."""
    plant = make_plant(leg(*LIGHT), Geometry(), HIP_AND_KNEE, "with_human")
    time = (np.arange(round(20 * RATE_HZ)) + 0.5) / RATE_HZ
    reference = excitation(time)
    drives = make_drives(
        np.array(KP), np.array(KD), np.array(LIMIT), np.array([409600.0] * 2), 1000.0, RATE_HZ
    )
    loop = loop_at_rest(plant.assembly, reference[0])
    angle, velocity, torque, truth = follow(plant.assembly, drives, loop, reference, 0.0)
    return {
        "time": time,
        "reference": reference,
        "angle": angle,
        "velocity": velocity,
        "torque": torque,
        "truth": truth,
    }


def controller() -> dict[str, Any]:
    return {
        name: {
            "type": "pd",
            "kp_nm_rad": KP[j],
            "kd_nm_s_rad": KD[j],
            "rate_hz": 1000.0,
            "limit_nm": LIMIT[j],
        }
        for j, name in enumerate(NAMES)
    }


@pytest.fixture
def recording_file(tmp_path, driven) -> Callable[..., Path]:
    """Write the driven leg as a recording/1 file; keywords change its metadata, None drops a
    key."""

    def write(rows=slice(None), columns=(), **metadata) -> Path:
        frame = pd.DataFrame({"time_s": driven["time"]})
        for quantity, unit in (("angle", "rad"), ("torque", "nm"), ("reference", "rad")):
            for j, name in enumerate(NAMES):
                frame[f"{name}_{quantity}_{unit}"] = driven[quantity][:, j]
        about = {
            "run": "with_human",
            "purpose": "validate",
            "sample_rate_hz": RATE_HZ,
            "controller": controller(),
        }
        about = {key: value for key, value in (about | metadata).items() if value is not None}
        path = tmp_path / "recording.parquet"
        RECORDING.write(path, frame.drop(columns=list(columns)).iloc[rows], about)
        return path

    return write
