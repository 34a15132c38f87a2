"""Describe the residual of the named causes, and extend the model by a smooth term."""

from typing import Any

import numpy as np

from pipelines.diagnosis.dependence.explained_share import Dependence, describe, excesses
from pipelines.diagnosis.dependence.smooth_term import smooth_term
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.joint_fit import residuals_on
from pipelines.diagnosis.fit.validation_error import errors_of


def unexplained(d: Diagnosis, dependences: list[Dependence]) -> dict[str, Any]:
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
    machine = d.baseline.machine
    errors = errors_of(d.validate, joints).rms[machine.measured]
    rms = zip(machine.measured_names, errors.tolist(), strict=True)
    # Most variables that the verdict lists for the remaining error.
    most = 5
    return {
        "description": describe(machine, dependences, above, term.surfaces),
        "depends_on": [
            {"joint": one.joint, "variable": one.variable, "share": one.share}
            for one in dependences[:most]
        ],
        # Its error is measured, as the term may do harm on the validation runs.
        "smooth_term": {"what": term.describe(), "rmse_nm": dict(rms)},
    }
