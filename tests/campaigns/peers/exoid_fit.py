"""exoid itself: what ``exoid identify`` and ``exoid diagnose`` do, from the recordings' files."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.diagnose import diagnose as find
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.estimation.regression import away_from_reversals, block_average
from pipelines.identification import identify as fit
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.read import read_motions
from tests.campaigns.peers.answer import NAMES, Answer
from tests.campaigns.real.relative_error import slow_error


@dataclass(frozen=True)
class HeldOut:
    """The validation run, on which every tool's torque (n, 2) N·m is held against the measured
    one."""

    motion: Motion

    def error(self, predicted: NDArray) -> NDArray:
        """RMS (2,) N·m of what is left in blocks of 25 ms away from reversals."""
        block = block_average(self.motion)
        starts = block.starts(self.motion.segment)
        moving = self.motion.valid & away_from_reversals(self.motion).all(axis=1)
        left = block.mean(self.motion.torque - predicted, starts)[block.all(moving, starts)]
        return np.sqrt(np.mean(left**2, axis=0))

    def slow_error(self, predicted: NDArray) -> NDArray:
        """RMS (2,) N·m of what is left below 5 Hz, reversals included."""
        return slow_error(predicted, self.motion).rms


@dataclass(frozen=True)
class Diagnosed:
    """What ``exoid diagnose`` says."""

    status: str
    causes: tuple[str, ...]
    """Effect, joint, values and probability of each, in words."""
    torque: NDArray
    """(n, 2) N·m that the extended model predicts of the validation run."""
    seconds: float


def identify(files: Sequence[Path]) -> tuple[Answer, HeldOut]:
    """Fit rigid body and friction."""
    begun = time.process_time()
    motions = read_motions(files)
    found = fit(motions)
    seconds = time.process_time() - begun
    # Coulomb and viscous friction stand by joints there, by kinds here.
    table = found.parameters.iloc[[0, 1, 2, 3, 4, 6, 5, 7]]
    values = table["value"].to_numpy(float)
    half_width = (table["ci95_high"] - table["ci95_low"]).to_numpy(float) / 2.0
    says = (*found.unrealizable, *found.collinear, *found.angle_noise, *found.remarks)
    return Answer("exoid", values, NAMES, values, half_width, np.asarray, seconds, says), HeldOut(
        _judged(motions)
    )


def diagnose(files: Sequence[Path]) -> Diagnosed:
    """Name what the baseline misses."""
    begun = time.process_time()
    motions = read_motions(files)
    found = find(motions)
    said = verdict(found)
    seconds = time.process_time() - begun
    model = model_of_run(found.after.fit, found.baseline, found.validate[0])
    causes = tuple(_in_words(cause) for cause in said["causes"])
    return Diagnosed(said["status"], causes, model.torque(_judged(motions)), seconds)


def _judged(motions: Sequence[Motion]) -> Motion:
    """Return the run to validate on."""
    (motion,) = (motion for motion in motions if motion.purpose == "validate")
    return motion


def _in_words(cause: dict) -> str:
    values = ", ".join(
        f"{row['name']} {row['value']:.3g} [{row['ci95'][0]:.3g}, {row['ci95'][1]:.3g}]"
        + f" {row['unit']}" * (row["unit"] != "1")
        for row in cause["parameters"]
    )
    return f"{cause['effect']} at {cause['joint']} ({cause['probability']:.2f}): {values}"
