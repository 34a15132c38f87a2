"""exoid itself: what ``exoid identify`` and ``exoid diagnose`` do, from the recordings' files."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.diagnosis.diagnose import diagnose as find
from pipelines.diagnosis.verdict import verdict
from pipelines.identification import identify as fit
from pipelines.identification.validation import residuals
from pipelines.mechanics.read import read_motions
from tests.peers.answer import NAMES, Answer, Log


@dataclass(frozen=True)
class HeldOut:
    """Blocks of 25 ms of the validation run, away from reversals: where every tool is scored. (n, 2) each."""

    q: NDArray
    dq: NDArray
    ddq: NDArray
    torque: NDArray

    def error(self, answer: Answer, log: Log) -> NDArray:
        """RMS (2,) N·m of what a tool's model leaves."""
        left = self.torque - answer.torque(self.q, self.dq, self.ddq, log)
        return np.sqrt(np.mean(left**2, axis=0))


@dataclass(frozen=True)
class Diagnosed:
    """What ``exoid diagnose`` says."""

    status: str
    causes: tuple[str, ...]
    """Effect, joint, values and probability of each, in words."""
    error: NDArray
    """RMS (2,) N·m that the extended model leaves."""
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
    judged = [motion for motion in motions if motion.purpose == "validate"]
    rows = pa.concat_tables(residuals(judged, found.models, "baseline")).to_pandas()
    rows = rows[rows["scored"]]
    quantities = ("angle_rad", "velocity_rad_s", "acceleration_rad_s2", "torque_nm")
    held_out = HeldOut(*(rows[[f"{joint}_{name}" for joint in motions[0].joints]].to_numpy() for name in quantities))
    return Answer("exoid", values, NAMES, values, half_width, np.asarray, seconds), held_out


def diagnose(files: Sequence[Path]) -> Diagnosed:
    """Name what the baseline misses."""
    begun = time.process_time()
    said = verdict(find(read_motions(files)))
    return Diagnosed(
        said["status"],
        tuple(_in_words(cause) for cause in said["causes"]),
        np.array(list(said["extended_rmse_nm"].values())),
        time.process_time() - begun,
    )


def _in_words(cause: dict) -> str:
    values = ", ".join(
        f"{row['name']} {row['value']:.3g} [{row['ci95'][0]:.3g}, {row['ci95'][1]:.3g}] {row['unit']}"
        for row in cause["parameters"]
    )
    return f"{cause['effect']} at {cause['joint']} ({cause['probability']:.2f}): {values}"
