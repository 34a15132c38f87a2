"""Evidence for causes other than their effect on the mean of the torque."""

from pipelines.diagnosis.evidence.cuff_coherence import cuff_coherence
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.effects import EFFECTS


def auxiliary_evidence(prepared: PreparedRuns) -> dict[str, float]:
    """Return the evidence of causes other than the mean torque.

    It is the part of the torque that cuffs and drives share, for effects with ``cuff_coherence``. A
    rhythm that is fitted explains some of it too.

    Parameters
    ----------
    prepared : PreparedRuns
        The searched runs and their residuals.

    Returns
    -------
    dict
        Log likelihood ratio by label.
    """
    ratios = cuff_coherence(prepared.runs, prepared.residuals)
    return {
        effect(joint=joint).label: float(ratio)
        for effect in EFFECTS
        if effect.cuff_coherence
        for joint, ratio in zip(prepared.baseline.joints, ratios, strict=True)
    }
