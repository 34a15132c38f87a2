"""Build ``verdict.json``: the diagnosis as its contract has it."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from pipelines.contracts.verdict import Cause
from pipelines.diagnosis.dependence.explained_share import Dependence, dependences
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.presliding_test import BuildUp
from pipelines.diagnosis.fit.validation import removed_share
from pipelines.diagnosis.selection.answer import NamedCause
from pipelines.diagnosis.verdict.cause_evidence import cause_evidence
from pipelines.diagnosis.verdict.caveats import caveats
from pipelines.diagnosis.verdict.control_benefit import control
from pipelines.diagnosis.verdict.error_budget import error_budget
from pipelines.diagnosis.verdict.findings_in_words import findings
from pipelines.diagnosis.verdict.summary import finding_in_words, floor_from, summary
from pipelines.diagnosis.verdict.unexplained import unexplained
from pipelines.effects import Effect, Tie
from pipelines.estimation.angle_noise import CUTOFF_HZ
from pipelines.estimation.regression import mask_in_words


def verdict(d: Diagnosis) -> dict[str, Any]:
    """Return the verdict as JSON objects, keys as in docs/contracts.md."""
    first, joints = d.validate[0], d.baseline.machine.joints
    causes = [_cause(d, named) for named in d.named]
    named = [Cause.model_validate(cause) for cause in causes]
    # Validation runs, because a fit hides what a model lacks from the runs that it has seen.
    before = dependences(d.validate, d.before.residuals)
    after = dependences(d.validate, d.after.residuals) if d.causes else before
    remainder = unexplained(d, after) if d.leaves_something else None
    low_pass = f"; torque and model behind a low-pass of {CUTOFF_HZ:g} Hz"
    return {
        "contract": "verdict/1",
        "status": d.status,
        "summary": summary(d, named, remainder),
        "finding": None if d.data.spoilt else finding_in_words(d, named, remainder),
        "findings": findings(d),
        "sought_on": "all" if d.sought_on_all else "train",
        "fitted_to": "all" if d.fitted_to_all else "train",
        "router": {
            joint.name: asdict(shares)
            for joint, shares in zip(joints, d.selected.router, strict=True)
            if joint.is_measured
        },
        **_detection_lines(d),
        "posterior": _posterior(d),
        "acquisition_at_fault": bool(d.data.spoilt),
        "caveats": caveats(d),
        "scoring": {
            "bandwidth_hz": first.bandwidth_hz,
            "mask": mask_in_words(d.baseline.machine) + low_pass * d.data.noisy_angles,
            "samples": int(d.after.errors.counts.sum()),
        },
        **_numbers(d),
        "control": control(d),
        "error_budget": error_budget(d),
        "depends_on": _depends_on(before, after),
        "reversals": [_reversal(d, one) for one in d.reversals],
        "units": {
            joint.name: {"torque": joint.unit("torque"), "angle": joint.unit("angle")}
            for joint in joints
            if joint.is_measured
        },
        "known": [
            {"effect": e.name, "joint": e.joint, "parameters": _parameters(d, e)}
            for e in d.baseline.known
        ],
        "causes": causes,
        "data_faults": [
            {
                "file": f.file,
                "channel": f.channel,
                "what": f.in_words,
                "kind": f.kind,
                "veto": f.is_veto,
                "proof": asdict(f.proof) if f.proof else None,
            }
            for f in d.data.faults
        ],
        "accepted": sorted({f.kind for f in d.data.faults if f.accepted}),
        "residual": remainder,
        "runs": sorted({run.motion.run for run in d.validate}),
        "noise_floor_from": floor_from(d),
    }


def _detection_lines(d: Diagnosis) -> dict[str, Any]:
    """Return the key of what detection lines show; none for motions without them."""
    of_joints = {joint: asdict(lines) for joint, lines in d.detection_lines.items()}
    return {"detection_lines": of_joints} if of_joints else {}


def _numbers(d: Diagnosis) -> dict[str, Any]:
    """Return the verdict's numbers by joint."""
    joints = d.baseline.machine.joints

    def by_joint(values: Any) -> dict[str, float | None]:
        if values is None:
            values = [None] * len(joints)
        # A joint whose torque was not measured has no error.
        pairs = [(j.name, v) for j, v in zip(joints, values, strict=True) if j.is_measured]
        return {joint: None if v is None else float(v) for joint, v in pairs}

    before, after = d.before.errors, d.after.errors
    return {
        "torque_rms_nm": by_joint(d.torque_rms),
        "noise_floor_nm": by_joint(d.floor_rms),
        "baseline_rmse_nm": by_joint(before.rms),
        "extended_rmse_nm": by_joint(after.rms),
        "baseline_rmse_unmasked_nm": by_joint(before.unmasked),
        "extended_rmse_unmasked_nm": by_joint(after.unmasked),
        "baseline_simulation_rmse_rad": by_joint(d.simulation_error["baseline"]),
        "extended_simulation_rmse_rad": by_joint(d.simulation_error["extended"]),
        "unexplained": by_joint(d.unexplained),
    }


def _posterior(d: Diagnosis) -> dict[str, Any] | None:
    """Return the probabilities of nothing missing, of something unlisted, and of each cause."""
    weighed, searched = d.selected.posterior, d.selected.searched
    if weighed is None or searched is None:
        return None
    listed = {e.label for e in weighed.elements if not e.is_law}
    return {
        "nothing_missing": d.selected.answer.nothing,
        "unlisted": d.selected.answer.unlisted,
        "causes": {label: p for label, p in weighed.marginals.items() if label in listed},
        "laws": {label: p for label, p in weighed.marginals.items() if label not in listed},
        "searched_causes": {label: p for label, p in searched.marginals.items() if label in listed},
        "validation_log_odds": dict(d.selected.charged),
        "systematic_error_removed": dict(d.selected.removed),
    }


def _parameters(d: Diagnosis, effect: Effect) -> list[dict[str, Any]]:
    """Return the fitted parameters of an effect with their intervals."""
    table = d.parameters
    # A cause of the whole machine has no joint, and pandas does not find None equal to None.
    here = table["joint"].isna() if effect.joint is None else table["joint"] == effect.joint
    return [
        {
            "name": row["name"],
            "value": float(row["value"]),
            "unit": row["unit"],
            "ci95": [float(row["ci95_low"]), float(row["ci95_high"])],
        }
        for row in table[(table["effect"] == effect.name) & here].to_dict("records")
    ]


def _depends_on(
    before: Sequence[Dependence], after: Sequence[Dependence]
) -> dict[str, list[dict[str, Any]]]:
    """Return the dependences of each joint's residual, under baseline and extended model."""
    shares = {(one.joint, one.variable): one.share for one in after}
    return {
        joint: [
            {
                "variable": one.variable,
                "share_before": one.share,
                "share_after": shares[joint, one.variable],
            }
            for one in before
            if one.joint == joint
        ]
        for joint in dict.fromkeys(one.joint for one in before)
    }


def _cause(d: Diagnosis, named: NamedCause) -> dict[str, Any]:
    label = named.element.label
    effect, gained = d.effects[label], d.gains[label]
    return {
        "effect": effect.name,
        "joint": effect.joint,
        "side": str(effect.side),
        "probability": named.probability,
        "parameters": _parameters(d, effect),
        "gain": {
            "rmse_reduction_nm": gained.value,
            "ci95": [gained.low, gained.high],
            "systematic_error_removed": removed_share(d.without[label], d.after),
            "joint": d.baseline.joints[gained.joint],
        },
        "indistinguishable_from": [_tie(effect, d.effect_of(tie), p) for tie, p in named.ties],
        "evidence": cause_evidence(d, named),
        "fitted_on_validate": [p.name for p in effect.parameters if p.per_run],
        "each_run": d.each_run.get(label, []),
    }


def _tie(effect: Effect, rival: Effect, probability: float) -> dict[str, Any]:
    """Return a tie, and why these two are not separated: for any data or on this motion only."""
    # Either effect may list the tie.
    tie = effect.ties.get(rival.name) or rival.ties.get(effect.name)
    tie = tie or Tie(
        "on this motion the difference of their torques is below the noise, or other parameters"
        " compensate it",
        f"for the one: {effect.confirm}; for the other: {rival.confirm}",
    )
    return {
        "effect": rival.name,
        "joint": rival.joint,
        "why": tie.why,
        "how_to_separate": tie.how_to_separate,
        "probability": probability,
        "per_run": rival.each_run,
    }


def _reversal(d: Diagnosis, one: BuildUp) -> dict[str, Any]:
    return {
        "joint": one.joint,
        "travel": one.travel,
        "unit": d.baseline.machine.joint(one.joint).unit("angle"),
        "at_once_rmse_nm": one.at_once,
        "otherwise_rmse_nm": one.otherwise,
        "over_travel_rmse_nm": one.over_travel,
    }
