"""Evidence for causes besides what they do to the mean of the torque."""

from pipelines.diagnosis.evidence.cuff_coherence import cuff_coherence
from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.effects import VoluntaryTorque


def auxiliary_evidence(prepared: Prepared) -> dict[str, float]:
    """Return the log likelihood ratio of each label besides what it does to the mean torque.

    Of a wearer's pushes it is what cuffs and drives share; a rhythm that is fitted explains some of
    it too.
    """
    ratios = cuff_coherence(prepared.runs, prepared.residuals)
    return {
        VoluntaryTorque(joint=joint).label: float(ratio)
        for joint, ratio in zip(prepared.baseline.joints, ratios, strict=True)
    }
