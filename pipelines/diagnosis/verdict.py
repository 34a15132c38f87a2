"""``verdict.json``: the diagnosis in the words of its contract."""

from typing import Any

import pandas as pd

from pipelines.diagnosis.control import control
from pipelines.diagnosis.dependence import dependences
from pipelines.diagnosis.diagnose import Diagnosis, summary_numbers
from pipelines.diagnosis.error_budget import error_budget
from pipelines.diagnosis.gain import gain
from pipelines.diagnosis.ties import tie_between
from pipelines.diagnosis.unknown import Unknown, unknown
from pipelines.effects import Effect
from pipelines.estimation.regression import MASK
from pipelines.model import effect_named

HIGHEST = 0.99
"""A probability never claims more than the calibration has shown."""


def verdict(d: Diagnosis) -> dict[str, Any]:
    """Return the verdict as JSON objects, keys as in docs/contracts.md."""
    first = d.validate[0]
    causes = [_cause(d, label) for label in d.causes]
    spoilt = any(fault.samples is None for fault in d.faults)
    left = unknown(d) if d.status in ("unknown_cause", "partly_explained") and not spoilt else None
    return {
        "contract": "verdict/1",
        "status": d.status,
        "summary": _summary(d, causes, left),
        "scoring": {
            "bandwidth_hz": first.block.cutoff_hz(first.motion.sample_rate_hz),
            "mask": MASK,
            "samples": int(d.after.errors.counts.sum()),
        },
        **summary_numbers(d),
        "control": control(d),
        "error_budget": error_budget(d),
        "depends_on": _depends_on(d),
        "causes": causes,
        "data_faults": [{"file": f.file, "channel": f.channel, "what": f.what} for f in d.faults],
        "residual": left.as_json() if left else None,
        "runs": sorted({run.motion.run for run in d.validate}),
        "noise_floor_from": "periods" if d.floor.from_periods else "the band above the motion",
    }


def _depends_on(d: Diagnosis) -> dict[str, list[dict[str, Any]]]:
    """Return what each joint's residual goes with, most first, as the baseline and as the extended model leave it."""
    before = dependences(d.validate, d.before.residuals)
    after = dependences(d.validate, d.after.residuals) if d.causes else before
    left = {(one.joint, one.variable): one.share for one in after}
    return {
        joint: [
            {"variable": one.variable, "share_before": one.share, "share_after": left[joint, one.variable]}
            for one in before
            if one.joint == joint
        ]
        for joint in d.baseline.joints
    }


def _split(label: str) -> tuple[str, str | None]:
    name, _, joint = label.partition("@")
    return name, joint or None


def _cause(d: Diagnosis, label: str) -> dict[str, Any]:
    name, joint = _split(label)
    effect = effect_named(name)(joint=joint)
    alike = d.alike(label)
    worth = gain(d.without[label].errors, d.after.errors)
    named_joint = d.baseline.joints[worth.joint]
    floor = d.standing.floor[worth.joint]
    power = d.without[label].errors.rms[worth.joint] ** 2 - floor**2
    removed = d.without[label].errors.rms[worth.joint] ** 2 - d.after.errors.rms[worth.joint] ** 2
    rows = _rows(d.parameters, name, joint)
    return {
        "effect": name,
        "joint": joint,
        "side": str(effect.side),
        "probability": min(sum(alike.values()), HIGHEST),
        "parameters": [
            {"name": r["name"], "value": r["value"], "unit": r["unit"], "ci95": [r["ci95_low"], r["ci95_high"]]}
            for r in rows
        ],
        "gain": {
            "rmse_reduction_nm": worth.value,
            "ci95": [worth.low, worth.high],
            "systematic_error_removed": float(min(max(removed / power, 0.0), 1.0)) if power > 0 else None,
            "joint": named_joint,
        },
        "indistinguishable_from": [
            _tie(effect, other, p, d) for other, p in sorted(alike.items(), key=lambda t: -t[1]) if other != label
        ],
        "evidence": _evidence(d, label, effect, worth.value, named_joint, alike),
        "fitted_on_validate": [p.name for p in effect.parameters if _of_a_run(effect, p.name)],
    }


def _of_a_run(effect: Effect, name: str) -> bool:
    return any(p.name == name and p.per_run for p in (*effect.linear, *effect.shape, *(effect.reported or ())))


def _rows(frame: pd.DataFrame, name: str, joint: str | None) -> list[dict[str, Any]]:
    here = frame["joint"].isna() if joint is None else frame["joint"] == joint
    return [
        {str(k): (float(v) if k in ("value", "ci95_low", "ci95_high") else v) for k, v in row.items()}
        for row in frame[(frame["effect"] == name) & here].to_dict("records")
    ]


def _tie(effect: Effect, other: str, probability: float, d: Diagnosis) -> dict[str, Any]:
    name, joint = _split(other)
    tie = tie_between(effect.name, name, effect.confirm, effect_named(name).confirm)
    return {
        "effect": name,
        "joint": joint,
        "why": tie.why,
        "how_to_separate": tie.how_to_separate,
        "probability": probability,
    }


def _evidence(d: Diagnosis, label: str, effect: Effect, worth: float, joint: str, alike: dict[str, float]) -> list[str]:
    before = d.without[label].errors.rms[d.baseline.joints.index(joint)]
    sentences = [f"it takes {worth:.2f} of {before:.2f} N·m of torque error at the {joint} on runs no fit has seen"]
    others = {k: p for k, p in d.likely[label].items() if k not in alike}
    if others:
        rival = max(others, key=lambda k: others[k])
        sentences.append(
            f"the next explanation, {rival}, is {d.likely[label][label] / others[rival]:.3g} times less likely"
        )
    sentences.append(f"it looks like {effect.looks_like}")
    sentences.append(f"to make sure: {effect.confirm}")
    return sentences


def _summary(d: Diagnosis, causes: list[dict[str, Any]], left: Unknown | None) -> str:
    floor = d.standing.floor
    error = d.before.errors.rms
    worst = int((error / floor).argmax())
    joint = d.baseline.joints[worst]
    size = f"{error[worst]:.2f} N·m at the {joint}, {error[worst] / floor[worst]:.2f} times the noise floor"
    spoilt = [fault for fault in d.faults if fault.samples is None]
    if spoilt:
        more = f" (and {len(spoilt) - 1} more)" if len(spoilt) > 1 else ""
        return f"Acquisition, not physics: {spoilt[0].file}, {spoilt[0].channel}: {spoilt[0].what}{more}."
    if d.status == "nothing_missing":
        return f"Nothing is missing that these data could show: the torque error is {size}."
    if d.status == "unknown_cause":
        return (
            f"The model misses something that no known cause explains: the torque error is {size}. "
            f"{left.description if left else ''}"
        )
    said = " and ".join(_in_words(cause) for cause in causes)
    after = d.after.errors.rms[worst]
    ending = "which explains it" if d.status == "explained" else "and more is left that they do not explain"
    return f"The simulation misses {said}. With it the torque error falls from {size}, to {after:.2f} N·m, {ending}."


def _in_words(cause: dict[str, Any]) -> str:
    title = effect_named(cause["effect"]).title.lower()
    where = f" at the {cause['joint']}" if cause["joint"] else ""
    ties = cause["indistinguishable_from"]
    if not ties:
        return f"{title}{where}"
    others = ", ".join(
        effect_named(t["effect"]).title.lower() + (f" at the {t['joint']}" if t["joint"] else "") for t in ties[:2]
    )
    return f"{title}{where} (or, as these data cannot tell, {others})"
