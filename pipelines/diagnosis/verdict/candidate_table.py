"""Build ``candidates/1``: every set of causes and laws that was weighed, and its verdict."""

from collections.abc import Iterator, Set
from typing import Any

import numpy as np
import pandas as pd

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.fit.validation_error import gain
from pipelines.effects import EFFECTS, Effect
from pipelines.mechanics.machine import Machine
from pipelines.wording.law import LAW


def candidates(d: Diagnosis) -> pd.DataFrame:
    """Return every set that was weighed, the named one first, then by probability."""
    machine, library, posterior = d.baseline.machine, d.selected.library, d.selected.posterior
    weighed = {} if posterior is None else posterior.by_labels
    # The empty set is no row; its probability is in the verdict.
    rows = [_row(d, labels, *_judged(d, labels, p), p) for labels, p in weighed.items() if labels]
    rows += [
        _row(
            d,
            {f"{effect.name}@{joint}"},
            "absorbed",
            f"it is part of {into} and cannot be separated from it",
        )
        for effect in EFFECTS
        for joint, into in _taken_up(effect, machine).items()
    ]
    left_out = "its torque is infinite, or rigid body and friction explain all of it"
    rows += [
        _row(d, {label}, "rejected", f"it was left out: {left_out}")
        for label in (library.left_out if library else ())
    ]
    order = {"named": 0, "indistinguishable": 1, "unlisted": 2, "rejected": 3, "absorbed": 4}
    rows.sort(key=lambda r: (order[r["verdict"]], -(r["probability"] or 0.0)))
    frame = pd.DataFrame(rows)
    frame.insert(0, "rank", range(1, len(frame) + 1))
    return frame


def _row(
    d: Diagnosis, labels: Set[str], verdict: str, reason: str, probability: float | None = None
) -> dict[str, Any]:
    """Return the row of a set; one that was not weighed has no numbers."""
    # Only the named set and its subsets by one are fitted in full; there are thousands of others.
    fitted = None if probability is None else _fitted(d, labels)
    own = gain(d.before.errors, fitted.errors) if fitted else None
    row: dict[str, Any] = {
        "causes": sorted(labels),
        "parameters": _parameters(fitted) if fitted else [],
        "train_score": _log_odds(d, probability or 0.0),
        "gain_nm": own and own.value,
        "gain_low_nm": own and own.low,
        "gain_high_nm": own and own.high,
        "probability": probability,
    }
    for j, joint in enumerate(d.baseline.machine.joints):
        known = joint.is_measured and probability is not None
        row[joint.column("rmse_before")] = float(d.before.errors.rms[j]) if known else None
        row[joint.column("rmse_after")] = float(fitted.errors.rms[j]) if known and fitted else None
    return row | {"verdict": verdict, "reason": reason}


def _log_odds(d: Diagnosis, probability: float) -> float | None:
    """Return the log posterior odds of a set against the empty one."""
    nothing = d.selected.answer.nothing
    if not probability > 0.0 or not nothing > 0.0:
        return None
    return float(np.log(probability) - np.log(nothing))


def _fitted(d: Diagnosis, labels: Set[str]) -> ValidationResult | None:
    """Return the fit of a set: the named one, or it without one cause; else None."""
    named = frozenset(d.causes)
    if labels == named:
        return d.after
    missing = named - labels
    return d.without[next(iter(missing))] if len(missing) == 1 and labels < named else None


def _parameters(fitted: ValidationResult) -> list[dict[str, Any]]:
    """Return the fitted parameters with their names in files; per-run parameters are left out."""
    rows: list[dict[str, Any]] = []
    for number, cause in enumerate(fitted.fit.causes):
        columns = fitted.fit.columns_of(number)
        if any(columns.per_run):
            continue
        amplitudes = columns.select(fitted.fit.values, None, np.zeros(len(columns.per_run)))
        values = cause.effect.physical(np.append(amplitudes, cause.shapes[0]))
        rows += [
            {"name": p.name, "value": float(v), "unit": p.unit}
            for p, v in zip(cause.effect.parameters, values, strict=True)
        ]
    return rows


def _judged(d: Diagnosis, labels: frozenset[str], probability: float) -> tuple[str, str]:
    named = frozenset(d.causes)
    if named and labels == named:
        return "named", "its causes are likely"
    for one in d.named:
        rest = named - {one.element.label}
        rivals = labels - rest
        # The named set with a tie in a cause's place is the same answer in other words.
        if rest <= labels and len(rivals) == 1 and next(iter(rivals)) in dict(one.ties):
            return "indistinguishable", f"these data cannot separate it from {one.element.label}"
    is_likely = probability >= CRITERIA.named_from and any(
        label.startswith(LAW) for label in labels
    )
    return "unlisted" if is_likely else "rejected", "; ".join(_against(d, labels, probability))


def _against(d: Diagnosis, labels: frozenset[str], probability: float) -> Iterator[str]:
    """Yield the reasons why a set is not named."""
    if d.selected.posterior is not None and labels in d.selected.posterior.unweighed:
        yield "it was left out: rounding made its matrix indefinite"
        return
    yield f"its probability is {probability:.2g}"
    if any(label.startswith(LAW) for label in labels):
        yield "it contains a law that is no listed cause"
    doubted = sorted(labels & d.selected.doubted - set(d.causes))
    if doubted:
        yield f"the validation runs speak against {' and '.join(doubted)}"


def _taken_up(effect: type[Effect], machine: Machine) -> dict[str, str]:
    """Return the joints at which other parameters absorb an effect whole, and which."""
    everywhere = machine.absorbs.get(effect.absorbed_as)
    by_joint = {
        joint: everywhere or effect.absorbed.get(machine.place(joint))
        for joint in machine.measured_names
    }
    return {joint: into for joint, into in by_joint.items() if into}
