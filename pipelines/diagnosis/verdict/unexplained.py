"""Describe the residual of the named causes, and extend the model by a smooth term."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.diagnosis.dependence.explained_share import Dependence, describe, excesses
from pipelines.diagnosis.dependence.smooth_term import smooth_term
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.joint_fit import residuals_on
from pipelines.diagnosis.fit.validation_error import errors_of

MENTIONED = 5
"""Most variables that the verdict lists for the remaining error."""


@dataclass(frozen=True)
class Unexplained:
    """The residual that no named cause explains."""

    description: str
    depends_on: list[Dependence]
    smooth: str
    """The smooth term in words."""
    rmse_nm: dict[str, float]
    """Of the model with the smooth term, on validation runs. It is measured, as the term may do
    harm there."""

    def as_json(self) -> dict[str, Any]:
        """Return the entry of the verdict."""
        return {
            "description": self.description,
            "depends_on": [
                {"joint": d.joint, "variable": d.variable, "share": d.share}
                for d in self.depends_on
            ],
            "smooth_term": {"what": self.smooth, "rmse_nm": self.rmse_nm},
        }


def unexplained(d: Diagnosis, dependences: list[Dependence]) -> Unexplained:
    """Describe the residual of the validation runs, and fit a smooth term to the training runs.

    Parameters
    ----------
    d : Diagnosis
        With the extended model.
    dependences : list of Dependence
        Of the extended model's residual.
    """
    # The term is fitted to training runs, as it is measured on validation runs.
    count = len(d.training_runs)
    residuals = residuals_on(d.after.fit, d.fitted_runs, d.baseline)
    term = smooth_term(d.training_runs, residuals[:count])
    above = excesses(d.validate, list(d.after.residuals), d.floor)
    joints = [
        r - np.nan_to_num(term.torque(run))
        for run, r in zip(d.validate, d.after.residuals, strict=True)
    ]
    rms = errors_of(d.validate, joints).rms
    return Unexplained(
        description=describe(d.baseline.machine, dependences, above, term.surfaces),
        depends_on=dependences[:MENTIONED],
        smooth=term.describe(),
        rmse_nm={joint: float(v) for joint, v in zip(d.baseline.joints, rms, strict=True)},
    )
