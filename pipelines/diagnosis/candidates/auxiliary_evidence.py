"""What is heard or felt of causes: evidence besides what they do to the mean of the torque."""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.diagnosis.evidence.cuff_coherence import evidence_of_will
from pipelines.diagnosis.evidence.impact_bursts import evidence_of_play
from pipelines.diagnosis.evidence.noise_floor import MOST_INDEPENDENT
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.effects import Backlash, Effect, VoluntaryTorque


def auxiliary_evidence(prepared: Prepared) -> dict[str, float]:
    """Return the log likelihood ratio of each label besides what it does to the mean torque."""
    runs, residuals = prepared.runs, prepared.residuals
    return heard_in(runs, residuals) | felt_in(runs, residuals)


def heard_in(runs: Sequence[Run], residuals: Sequence[NDArray]) -> dict[str, float]:
    """Return the log likelihood of play that residuals (m, O) tell besides their mean over periods, by label."""
    return _by_label(Backlash, runs, evidence_of_play(runs, residuals, MOST_INDEPENDENT))


def felt_in(runs: Sequence[Run], residuals: Sequence[NDArray]) -> dict[str, float]:
    """Return that of a wearer's pushes, of residuals (m, O). A rhythm fitted to them explains some of it too."""
    return _by_label(VoluntaryTorque, runs, evidence_of_will(runs, residuals))


def _by_label(effect: type[Effect], runs: Sequence[Run], gains: NDArray) -> dict[str, float]:
    joints = runs[0].motion.joints
    return {effect(joint=joint).label: float(gain) for joint, gain in zip(joints, gains, strict=True)}
