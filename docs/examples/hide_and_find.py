"""Hide a knee spring in a virtual leg, record it without any device, and diagnose it."""

import numpy as np

from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.model import effect_named, term_from
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings

# Angles in rad: a mean, and sines and cosines of three harmonics for hip and knee.
# The period is 5 s.
EXCITATION = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=2 * np.pi / 5.0,
)
SPRING = term_from(
    effect_named("parallel_spring")(joint="knee"), {"stiffness": 8.0, "rest_angle": -0.9}
)


def recorded(run: str, purpose: str, seed: int):
    """Record 20 s of one run and filter it."""
    leg = Plant(PlantSettings(), run, seed=seed, effects=[SPRING])
    recording = Table(*record(leg, EXCITATION, 20.0, purpose))
    return motion_from_table(motion_table(recording, FilterSettings()))


runs = [(run, purpose) for run in ("exo_alone", "with_human") for purpose in ("train", "validate")]
motions = [recorded(run, purpose, seed) for seed, (run, purpose) in enumerate(runs)]
result = verdict(diagnose(motions))

print(result["summary"])
for cause in result["causes"]:
    for parameter in cause["parameters"]:
        low, high = parameter["ci95"]
        print(
            f"{parameter['name']:12s} {parameter['value']:7.3f} {parameter['unit']:8s} 95 %:"
            f" {low:.3f} to {high:.3f}"
        )

assert [(cause["effect"], cause["joint"]) for cause in result["causes"]] == [
    ("parallel_spring", "knee")
]
