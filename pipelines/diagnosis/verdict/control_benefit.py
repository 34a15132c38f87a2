"""Simulate the adaptive control loop on the model without and with the named causes.

The controller has no model of the leg; its network learns one. So the causes change the simulated
leg, and with it the predicted tracking error and torque.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from pipelines.contracts.joints import joints_of
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.fitted_model import fitted_model
from pipelines.dynamics.plant import make_plant
from pipelines.dynamics.tracking import track
from pipelines.errors import ExoidError, InputError
from pipelines.mechanics.gait import gait
from pipelines.model import Model, Term
from pipelines.settings.simulate import SimulateSettings


def control(d: Diagnosis) -> dict[str, Any]:
    """Return tracking error and peak torque of the adaptive loop, as JSON objects.

    They are predicted without and with the named causes, from ``settled_after_s`` on: before, the
    drives are at their limit, whatever the leg.
    """
    # The reference case of docs/simulation.md is the same for every machine, so that numbers can be
    # compared.
    case = SimulateSettings()
    # The loop is meant for a leg with a wearer; without such runs the empty machine stands in.
    run = "with_human" if "with_human" in d.baseline.kinds else d.baseline.kinds[0]
    benefit: dict[str, Any] = {
        "run": run,
        "controller": {
            "type": "rbf",
            "reference": "gait",
            # These settings of `exoid simulate` do not change the loop.
            **case.model_dump(mode="json", exclude={"sweep_nm_s_rad", "figures"}),
        },
        "without": None,
        "with": None,
        "reason": None,
    }
    if not d.baseline.machine.is_exoskeleton:
        return benefit | {"reason": "the reference case is a leg's gait, with its gains and limits"}
    if d.data.spoilt:
        return benefit | {
            "reason": "acquisition is at fault: no model of these recordings can be trusted"
        }
    fits = {"without": d.before.fit, "with": d.after.fit} if d.causes else {"without": d.before.fit}
    reasons = [] if d.causes else ["no cause is named"]
    for which, fitted in fits.items():
        try:
            benefit[which] = _tracked(fitted_model(fitted, d.baseline, run), run, case, d)
        except ExoidError as error:
            # Only the first sentence applies: the second is advice for `exoid simulate`.
            reasons.append(f"{which} the causes: {str(error).partition('. ')[0]}")
    return benefit | {"reason": "; ".join(reasons) or None}


def _tracked(
    model: Model, run: str, case: SimulateSettings, d: Diagnosis
) -> dict[str, dict[str, float]]:
    motion = d.validate[0].motion
    terms = tuple(_from_the_start(term) for term in model)
    loop = track(
        make_plant(Model(terms), motion.geometry, joints_of(motion.metadata), run), case, gait()
    )
    # A loop that diverges has no tracking error; the verdict gives the reason instead.
    if loop.ran_away:
        raise InputError(loop.ran_away)
    settled = loop.time >= case.settled_after_s
    rms = np.sqrt(np.mean(loop.error[settled] ** 2, axis=0))
    peak = np.abs(loop.run.torque[settled]).max(axis=0)
    joints = d.baseline.joints
    return {
        "tracking_rmse_rad": dict(zip(joints, rms.tolist(), strict=True)),
        "peak_torque_nm": dict(zip(joints, peak.tolist(), strict=True)),
    }


def _from_the_start(term: Term) -> Term:
    """Return a term whose onset is the run's start, as the loop might end before it."""
    # Onsets are the only per-run values in seconds.
    onset = [p.per_run and p.unit == "s" for p in term.effect.fitted]
    return replace(term, values=np.where(onset, 0.0, term.values))
