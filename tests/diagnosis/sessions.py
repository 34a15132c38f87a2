"""Sessions for the tests of the diagnosis: the embedded plant, recorded alone and with a wearer."""

import copyreg
from dataclasses import replace

import numpy as np

from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.model import effect_named, term_from
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.once import once

RICH = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=0.2 * np.pi,
)
RUNS = [(run, purpose) for run in ("exo_alone", "with_human") for purpose in ("train", "validate")]


SLOW = replace(RICH, omega=0.5 * RICH.omega)


@once
def recordings(effect=None, joint=None, seed=1, seconds=20.0, trained=RICH, **values):
    """Return four recordings of a leg with an effect hidden in it; the training runs follow
    ``trained``."""
    hidden = [term_from(effect_named(effect)(joint=joint), values)] if effect else []
    tables = []
    for number, (run, purpose) in enumerate(RUNS):
        plant = Plant(PlantSettings(), run, seed=10 * seed + number, effects=hidden)
        tables.append(
            Table(*record(plant, trained if purpose == "train" else RICH, seconds, purpose))
        )
    return tables


def banded(motions):
    """Return motions of a leg with a band from the pelvis to the shank that is slack in a part of
    its range."""
    pulled = []
    for motion in motions:
        stretch = np.maximum(motion.q @ (0.8, -0.7) - 1.1, 0.0)
        pulled.append(replace(motion, torque=motion.torque + 12.0 * np.outer(stretch, (0.8, -0.7))))
    return pulled


@once
def session(*args, **values):
    """Return the motions of these recordings, files named by their place."""
    motions = [
        motion_from_table(motion_table(table, FilterSettings()))
        for table in recordings(*args, **values)
    ]
    return [replace(m, file=f"run_{i}.parquet") for i, m in enumerate(motions)]


@once
def diagnosed(*args, **values):
    """Return the diagnosis of such a session."""
    return diagnose(session(*args, **values))


def _without_factorisation(regression):
    """Reduce a regression to what can be stored; the factorisation is computed again where it is
    used."""
    state = {name: value for name, value in vars(regression).items() if name != "_coloured"}
    return object.__new__, (DecisionRegression,), state


copyreg.pickle(DecisionRegression, _without_factorisation)
