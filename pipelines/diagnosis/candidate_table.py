"""``candidates/1``: every set of causes that was tried, and what became of it."""

from typing import Any

import numpy as np
import pandas as pd

from pipelines.diagnosis.choice import MATERIAL, NEEDED, Ranked
from pipelines.diagnosis.diagnose import Diagnosis
from pipelines.diagnosis.examined import Extended
from pipelines.diagnosis.gain import gain
from pipelines.effects import EFFECTS, Effect
from pipelines.mechanics.machine import Machine


def candidates(d: Diagnosis) -> pd.DataFrame:
    """Return every set tried, the named one first, then by score."""
    rows = [
        _row(d, labels, scored.score, refined.get(labels))
        for level, refined in zip(d.choice.levels, d.choice.refined[1:], strict=False)
        for labels, scored in level.items()
        if np.isfinite(scored.score) and len(set(labels)) == len(labels)
    ]
    rows += [_absorbed(d, effect.name, joint, into) for effect in EFFECTS
             for joint, into in _taken_up(effect, d.baseline.machine).items()]  # fmt: skip
    order = {"named": 0, "indistinguishable": 1, "rejected": 2, "absorbed": 3}
    rows.sort(key=lambda r: (order[r["verdict"]], -(r["train_score"] or 0.0)))
    frame = pd.DataFrame(rows)
    frame.insert(0, "rank", range(1, len(frame) + 1))
    return frame


def _row(d: Diagnosis, labels: tuple[str, ...], score: float, ranked: Ranked | None) -> dict[str, Any]:
    if labels == d.choice.named.labels:  # its zeros may be each run's own, which the search's were not
        ranked = d.choice.named
    extended = _evaluated(d, labels, ranked)
    row: dict[str, Any] = {
        "causes": list(labels),
        "parameters": _parameters(ranked, d) if ranked else [],
        "train_score": ranked.score if ranked else score,
        "gain_nm": None,
        "gain_low_nm": None,
        "gain_high_nm": None,
        "probability": _probability(d, labels),
    }
    for j, joint in enumerate(d.baseline.machine.joints):
        row[joint.column("rmse_before")] = float(d.before.errors.rms[j])
        row[joint.column("rmse_after")] = float(extended.errors.rms[j]) if extended else None
    if extended:
        worth = gain(d.before.errors, extended.errors)
        row |= {"gain_nm": worth.value, "gain_low_nm": worth.low, "gain_high_nm": worth.high}
    more = _gained_beyond_named(d, labels, score, ranked)
    row["verdict"], row["reason"] = _judged(d, labels, row["train_score"], more)
    return row


def _evaluated(d: Diagnosis, labels: tuple[str, ...], ranked: Ranked | None) -> Extended | None:
    if ranked is None:
        return None
    if labels == d.choice.named.labels:
        return d.after
    return Extended.of(ranked.fit, d.validate, d.baseline)


def _parameters(ranked: Ranked, d: Diagnosis) -> list[dict[str, Any]]:
    """Return what was fitted, as files name it; amplitudes that each run has for itself are left out."""
    found = []
    for number, cause in enumerate(ranked.fit.causes):
        effect, columns = cause.effect, ranked.fit.columns_of(number)
        if not any(columns.per_run):
            fitted = np.append(ranked.fit.values[columns.slice], cause.shapes[0])
            found += [
                {"name": p.name, "value": float(v), "unit": p.unit}
                for p, v in zip(effect.parameters, effect.physical(fitted), strict=True)
            ]
    return found


def _probability(d: Diagnosis, labels: tuple[str, ...]) -> float | None:
    """Return how likely a set is that differs from the named one in one cause at most."""
    if not d.causes:
        return None
    named = set(d.choice.named.labels)
    if set(labels) == named:
        return float(np.prod([d.likely[label][label] for label in named]))
    if len(labels) != len(named) or len(named - set(labels)) != 1:
        return None
    label, rival = (named - set(labels)).pop(), (set(labels) - named).pop()
    return d.likely[label].get(rival)


def _gained_beyond_named(d: Diagnosis, labels: tuple[str, ...], score: float, ranked: Ranked | None) -> float | None:
    """Return how much more log likelihood a set gains than what is named does; None where it holds not all of that.

    Both with their shapes refined, or neither: refined ones are scored on what they were fitted to.
    """
    named = d.choice.named
    if not set(named.labels) < set(labels) or not named.labels:
        return None
    if ranked:
        return ranked.score - named.score
    return score - d.choice.levels[len(named.labels) - 1][named.labels].score


def _too_little(extra: str, more: float) -> str:
    """Say how little one more cause adds, and how much it must."""
    if more < NEEDED:
        why = f"{more:+.1f} in log likelihood, where one more cause must gain {NEEDED:g}"
    else:
        why = (
            f"{more:+.1f} in log likelihood, but not {MATERIAL:.0%} of a joint's error, or no more than what is named "
            "gains in a freer form"
        )
    return f"{extra} adds too little beside what is named: {why}"


def _barred(d: Diagnosis, labels: tuple[str, ...]) -> str:
    """Return why a set could not be named whatever it explains; empty where it could."""
    if why := d.choice.absurd.get(labels):
        return f"no machine or person has it as it was fitted: {why}"
    if labels in d.choice.shadows:
        return "its rhythm is a multiple of the motion's own, and takes what its other causes leave or little"
    return ""


def _judged(d: Diagnosis, labels: tuple[str, ...], score: float, more: float | None) -> tuple[str, str]:
    best = d.choice.named
    if d.causes and labels == best.labels:
        return "named", "it earned its place: nothing smaller explains as much, nothing larger enough more"
    if labels in d.choice.refuted:
        return "rejected", "it explains the train runs about as well as anything does, and fails on validation runs"
    if not d.causes:
        return "rejected", _barred(d, labels) or (
            f"it gains {score:.1f} in log likelihood; a cause must gain {NEEDED:g}, take away a material share of a "
            "joint's error, and hold up on validation runs"
        )
    if len(labels) == len(best.labels):
        for label in d.causes:
            rest = set(best.labels) - {label}
            rivals = set(labels) - rest
            if rest <= set(labels) and len(rivals) == 1 and next(iter(rivals)) in d.alike(label):
                return "indistinguishable", f"it explains these data as well as {label} does"
    if barred := _barred(d, labels):
        return "rejected", barred
    if more is not None:
        return "rejected", _too_little(" and ".join(sorted(set(labels) - set(best.labels))), more)
    return (
        "rejected",
        f"it explains less than {' and '.join(best.labels)} (log likelihood {best.score - score:.1f} behind)",
    )


def _taken_up(effect: type[Effect], machine: Machine) -> dict[str, str]:
    """Return the joints of a machine at which other parameters take an effect up whole, and which."""
    everywhere = machine.mechanism.absorbs.get(effect.name)
    by_joint = {joint: everywhere or effect.absorbed.get(machine.place(joint)) for joint in machine.names}
    return {joint: into for joint, into in by_joint.items() if into}


def _absorbed(d: Diagnosis, name: str, joint: str, into: str) -> dict[str, Any]:
    blank = {j.column(f"rmse_{when}"): None for j in d.baseline.machine.joints for when in ("before", "after")}
    return {
        "causes": [f"{name}@{joint}"], "parameters": [], "train_score": None, "gain_nm": None, "gain_low_nm": None,
        "gain_high_nm": None, "probability": None, **blank, "verdict": "absorbed",
        "reason": f"it is part of {into} and cannot be seen apart from it",
    }  # fmt: skip
