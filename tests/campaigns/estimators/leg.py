"""Whole sessions of MuJoCo's leg, with a wearer, by the two steps."""

import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from pipelines.estimation.estimator import Estimator
from pipelines.identification import identify
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.read import read_motions
from pipelines.settings.filter import FilterSettings
from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.plan import Run
from tests.campaigns.blind.session import Session, simulate, write
from tests.campaigns.estimators.markdown import show as table

SEED = 480_000
"""Within the range for tuning."""


def show(methods: Sequence[Estimator], sessions: int) -> None:
    """Print bias, coverage, error on runs not fitted, and time."""
    made = [simulate(Case(SEED + number, "none", plain=True)) for number in range(sessions)]
    title = (
        f"**a leg simulated by MuJoCo**, {sessions} sessions of four runs of 60 to 80 s, nothing"
        " hidden"
    )
    headings = ("method", "worst bias of X", "of friction", "covered", "validation RMSE N·m", "s")
    table(title, headings, _rows(methods, made))


def _rows(methods: Sequence[Estimator], sessions: list[Session]) -> Iterator[tuple[str, ...]]:
    with tempfile.TemporaryDirectory() as folder:
        recorded = []
        for number, session in enumerate(sessions):
            runs = Path(folder) / str(number)
            write(session, runs, Path(folder) / f"{number}.json")
            recorded.append(
                (read_motions(sorted(runs.iterdir()), FilterSettings(), Geometry()), truth(session))
            )
    for estimator in methods:
        begun, off, inside, left = time.process_time(), [], [], []
        for motions, true in recorded:
            found = identify(motions, estimator)
            rows = found.parameters
            off.append((rows["value"] / true - 1.0).to_numpy())
            inside.append(((rows["ci95_low"] <= true) & (true <= rows["ci95_high"])).to_numpy())
            left.append(found.validation.pooled.rmse)
        bias = 100.0 * np.mean(off, axis=0)
        is_friction = (rows["effect"] == "friction").to_numpy()
        worst = (max(bias[chosen], key=abs) for chosen in (~is_friction, is_friction))
        seconds = (time.process_time() - begun) / len(recorded)
        yield (
            estimator.name,
            *(f"{b:+.1f} %" for b in worst),
            f"{100.0 * np.mean(inside):.0f} %",
            " / ".join(f"{rmse:.3f}" for rmse in np.mean(left, axis=0)),
            f"{seconds:.2g}",
        )


def truth(session: Session) -> np.ndarray:
    """Return true values in the order of the rows of ``parameters/1``."""
    exo, whole = (
        np.array(session.rig.leg(Run(kind, "train", 0.0, None)).inertial())
        for kind in ("exo_alone", "with_human")
    )
    machine = session.rig.machine
    rotor = np.array([machine.hip_rotor, 0.0, 0.0, 0.0])  # turns with the thigh: a part of X1
    friction = np.column_stack([machine.coulomb, machine.viscous]).ravel()
    return np.concatenate([exo + rotor, friction, whole + rotor, whole - exo])
