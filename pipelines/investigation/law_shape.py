"""An unlisted law as a rival: a free function of the motion, on all that the leg may reach."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.smooth_laws import Spans, smooth_laws
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.settings.design import JointBounds
from pipelines.wording.law import LAWS, kind_and_joint

NO_FUNCTIONS = ("time", "sensor")
"""Families of the laws that are no function of the motion, so that no motion shows them better."""


def can_be_planned(label: str) -> bool:
    """Return whether a law is a function of the motion."""
    kind, _ = kind_and_joint(label)
    return kind in LAWS and LAWS[kind][0] not in NO_FUNCTIONS


# A shape is a key by its identity: arrays have no hash.
@dataclass(frozen=True, eq=False)
class LawShape:
    """A law with the scales of its functions."""

    label: str
    spans: Spans
    typical: NDArray
    """(k,) standard deviation of the amplitude of each function before any data."""

    @classmethod
    def of(cls, label: str, problem: DetectionProblem, bounds: JointBounds) -> "LawShape":
        """Return a law on all angles within the bounds.

        A function of the diagnosed angles alone would say anything beyond them.
        """
        run = problem.runs[0]
        joints = run.state[0].shape[1]
        spans = Spans.of(problem.runs, problem.torque_rms[:joints])
        laws, _ = smooth_laws(run, spans, np.zeros((len(run.time), joints)))
        own = [law for law in laws if law.variant(run.motion.joints) == label]
        variance = np.array([law.variance for law in own])
        low, high = np.transpose([bounds.hip.angle_rad, bounds.knee.angle_rad])
        half = 0.5 * (high - low)
        return cls(
            label,
            replace(
                spans,
                middle=0.5 * (high + low),
                half_range=half,
                sum_middle=0.5 * float((high + low).sum()),
                sum_half_range=float(half.sum()),
            ),
            max(CRITERIA.amplitudes) * np.sqrt(variance / variance.sum()),
        )

    def parts(self, problem: DetectionProblem) -> list[NDArray]:
        """Return the torque of each function as large as that of the joint, (m, O, k) of runs."""
        joints = len(self.spans.torque)
        parts = []
        for run, columns in zip(problem.runs, problem.untouched, strict=True):
            laws, values = smooth_laws(run, self.spans, (columns @ problem.values)[:, :joints])
            own = [law.variant(run.motion.joints) == self.label for law in laws]
            drives = values[:, :, own] * self.spans.torque[:, np.newaxis]
            parts.append(np.concatenate([drives, np.zeros_like(drives)], axis=1))
        return parts
