"""``verdict.json``: the diagnosis in the words of its contract."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from pipelines.contracts.joints import the
from pipelines.diagnosis.choice import in_place_of
from pipelines.diagnosis.control import control
from pipelines.diagnosis.dependence import Dependence, dependences
from pipelines.diagnosis.diagnose import Diagnosis, summary_numbers
from pipelines.diagnosis.error_budget import error_budget
from pipelines.diagnosis.faults import Fault
from pipelines.diagnosis.perceived import PERCEIVED
from pipelines.diagnosis.reversals import NEAR_S, BuildUp
from pipelines.diagnosis.status import AT_FLOOR, EXPLAINED, IMPERFECT
from pipelines.diagnosis.ties import tie_between
from pipelines.diagnosis.unknown import Unknown, unknown
from pipelines.effects import Effect, PreslidingHysteresis
from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS
from pipelines.estimation.regression import mask_in_words
from pipelines.label import amount, cause_label, effect_labelled, effect_told, in_words, number
from pipelines.mechanics.geometry import Geometry

HIGHEST = 0.96
"""A probability never claims more than calibration has shown: some causes that nobody lists look like a listed one."""
OF_THREE = 0.5
"""Three causes together can imitate nearly anything: each is as likely there as not."""


HIDING = 0.2
"""Share of a joint's torque from which a guessed floor is told as one that hides what may be missing: no drive's
current and no torque sensor is as noisy as that, so much of it is what the model lacks; and friction is seldom more."""
PLAIN = 1.25
"""Times the floor from which what is left is described, whatever share the causes took away."""
MENTIONED = 3
"""Causes that could stand for each other, in the summary; ``indistinguishable_from`` has all."""
CERTAIN = 1000.0
"""Odds from which more is not told."""


def verdict(d: Diagnosis) -> dict[str, Any]:
    """Return the verdict as JSON objects, keys as in docs/contracts.md."""
    first = d.validate[0]
    causes = _never_rising([_cause(d, label) for label in d.causes])
    before = dependences(d.validate, d.before.residuals)
    after = dependences(d.validate, d.after.residuals) if d.causes else before
    left = unknown(d, after) if _leaves_something(d) else None
    return {
        "contract": "verdict/1",
        "status": d.status,
        "summary": _summary(d, causes, left),
        "finding": None if d.spoilt else _finding(d, causes, left),
        "acquisition_at_fault": bool(d.spoilt),
        "caveats": _caveats(d),
        "scoring": {
            "bandwidth_hz": first.bandwidth_hz,
            "mask": mask_in_words(d.baseline.machine)
            + (f"; torque and model behind a low-pass of {CUTOFF_HZ:g} Hz" if d.noisy_angles else ""),
            "samples": int(d.after.errors.counts.sum()),
        },
        **summary_numbers(d),
        "control": control(d),
        "error_budget": error_budget(d),
        "depends_on": _depends_on(before, after),
        "reversals": [_reversal(d, one) for one in d.reversals],
        "units": {
            joint.name: {"torque": joint.unit("torque"), "angle": joint.unit("angle")}
            for joint in d.baseline.machine.joints
        },
        "known": [_known(d, effect) for effect in d.baseline.known],
        "causes": causes,
        "data_faults": [{"file": f.file, "channel": f.channel, "what": f.what} for f in d.faults],
        "residual": left.as_json() if left else None,
        "runs": sorted({run.motion.run for run in d.validate}),
        "noise_floor_from": _floor_from(d),
    }


def _leaves_something(d: Diagnosis) -> bool:
    """Tell whether more than noise is left: a cause that explains four fifths may leave many times the floor."""
    if d.spoilt or d.status == "nothing_missing":
        return False
    plain = d.standing.systematic(d.standing.slow_after) | (d.standing.extended > PLAIN * d.standing.floor)
    return d.status != "explained" or bool(plain.any())


def _known(d: Diagnosis, effect: Effect) -> dict[str, Any]:
    return {"effect": effect.name, "joint": effect.joint, "parameters": _values(_rows(d.parameters, effect))}


def _values(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [
        {"name": r["name"], "value": r["value"], "unit": r["unit"], "ci95": [r["ci95_low"], r["ci95_high"]]}
        for r in rows
    ]


def _depends_on(before: Sequence[Dependence], after: Sequence[Dependence]) -> dict[str, list[dict[str, Any]]]:
    """Return what each joint's residual goes with, most first, as the baseline and as the extended model leave it."""
    left = {(one.joint, one.variable): one.share for one in after}
    return {
        joint: [
            {"variable": one.variable, "share_before": one.share, "share_after": left[joint, one.variable]}
            for one in before
            if one.joint == joint
        ]
        for joint in dict.fromkeys(one.joint for one in before)
    }


def _cause(d: Diagnosis, label: str) -> dict[str, Any]:
    effect = d.effects[label]
    alike = d.alike(label)
    worth = d.gains[label]
    named_joint = d.baseline.joints[worth.joint]
    floor = d.standing.floor[worth.joint]
    power = d.without[label].errors.rms[worth.joint] ** 2 - floor**2
    removed = d.without[label].errors.rms[worth.joint] ** 2 - d.after.errors.rms[worth.joint] ** 2
    rows = _rows(d.parameters, effect)
    return {
        "effect": effect.name,
        "joint": effect.joint,
        "side": str(effect.side),
        "probability": _probability(d, label),
        "parameters": _values(rows),
        "gain": {
            "rmse_reduction_nm": worth.value,
            "ci95": [worth.low, worth.high],
            "systematic_error_removed": float(min(max(removed / power, 0.0), 1.0)) if power > 0 else None,
            "joint": named_joint,
        },
        "indistinguishable_from": [
            _tie(effect, in_place_of(d.choice, d.bank, label, other), p)
            for other, p in sorted(alike.items(), key=lambda t: -t[1])
            if other != label
        ],
        "evidence": _evidence(d, label, effect, worth.value, named_joint, alike),
        "fitted_on_validate": [p.name for p in effect.parameters if p.per_run],
        "each_run": d.each_run.get(label, []),
    }


def _rows(frame: pd.DataFrame, effect: Effect) -> list[dict[str, Any]]:
    here = frame["joint"].isna() if effect.joint is None else frame["joint"] == effect.joint
    return [
        {str(k): (float(v) if k in ("value", "ci95_low", "ci95_high") else v) for k, v in row.items()}
        for row in frame[(frame["effect"] == effect.name) & here].to_dict("records")
    ]


def _never_rising(causes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Let no cause be more probable than one before it: among nearly equals the order is that of what each explains."""
    least = 1.0
    for cause in causes:
        least = cause["probability"] = min(cause["probability"], least)
    return causes


def _probability(d: Diagnosis, label: str) -> float:
    """Return how likely a named cause is: among its rivals, and that what is missing is of this kind at all."""
    crowded = OF_THREE if len(d.causes) > 2 else 1.0
    # Each cause is doubted for what all of them leave.
    return HIGHEST * crowded * d.standing.trust ** len(d.causes) * d.chance(label)


def _tie(effect: Effect, rival: Effect, probability: float) -> dict[str, Any]:
    tie = tie_between(effect.name, rival.name, effect.confirm, rival.confirm)
    return {
        "effect": rival.name,
        "joint": rival.joint,
        "why": tie.why,
        "how_to_separate": tie.how_to_separate,
        "probability": probability,
        "per_run": rival.each_run,
    }


def _evidence(d: Diagnosis, label: str, effect: Effect, worth: float, joint: str, alike: dict[str, float]) -> list[str]:
    before = d.without[label].errors.rms[d.baseline.joints.index(joint)]
    machine = d.baseline.machine
    others_leave = " that the other causes leave" if len(d.causes) > 1 else ""
    taken = number(machine, worth) if worth > 0.0 else "nothing"
    sentences = [
        f"it takes {taken} of {amount(machine, joint, before)} of {machine.joint(joint).effort} error "
        f"at {the(joint)}{others_leave} on runs no fit has seen"
    ]
    if doubt := _doubt(d, label):
        sentences.append(doubt[1])
    if effect.each_run:
        sentences.append(_set_anew(d, label, effect))
    if form := d.of_a_freer_form.get(label):
        sentences.append(f"without it {form.instead}")
    if label in d.perceived:
        sentences.append(PERCEIVED[effect.name])
    others = {k: p for k, p in d.likely[label].items() if k not in alike}
    if others:
        rival = max(others, key=lambda k: others[k])
        sentences.append(
            f"of the other causes that exoid knows the next, {in_words(effect_labelled(rival))}, is "
            f"{_times(d.likely[label][label], others[rival])} less likely"
        )
    sentences.append(f"it looks like {effect.looks_like}")
    sentences.append(f"to make sure: {effect.confirm}")
    return sentences


def _set_anew(d: Diagnosis, label: str, effect: Effect) -> str:
    """Say what each run has of a cause that is another in every run."""
    (parameter,) = (p for p in effect.parameters if p.per_run)
    told = [f"{one['values'][parameter.name]:+.3g} in {one['file']}" for one in d.each_run[label]]
    return f"each run has its own {parameter.name}, as of {effect.may_differ}: {', '.join(told)} ({parameter.unit})"


def _doubt(d: Diagnosis, label: str) -> tuple[str, str] | None:
    """Say, in the summary and by itself, that a cause neither heard nor felt gains no more than chance may; or None."""
    its = d.gains.get(label)
    if its is None or label in d.perceived or its.low > 0.0:
        return None
    if its.high < 0.0:
        return "which gains nothing on runs no fit has seen", "that is no gain: its 95 % interval lies below nought"
    return "whose gain may be chance", "that gain may be chance: its 95 % interval includes nought"


def _times(likely: float, other: float) -> str:
    """Return the odds in words; beyond a thousand no calibration could vouch for a figure."""
    return f"{likely / other:.3g} times" if likely < CERTAIN * other else f"over {CERTAIN:g} times"


def _summary(d: Diagnosis, causes: list[dict[str, Any]], left: Unknown | None) -> str:
    if d.spoilt:
        return f"Acquisition, not physics: {_in_short(d.spoilt[0], d)}."
    said = _finding(d, causes, left)
    if not d.floor.from_periods:
        told = any(run.motion.period_s for run in (*d.train, *d.validate))
        why = "No run holds two periods" if told else "No recording tells of a period after which its motion repeats"
        said += f" {why}, so the noise floor is a guess from {_floor_from(d)}."
    return f"{said} Beside it, faults of acquisition: {_in_short(d.faults[0], d)}." if d.faults else said


def _floor_from(d: Diagnosis) -> str:
    """Say what the noise floor was read off."""
    if d.floor.from_periods:
        return "periods"
    return "what the model leaves of the motion's own band" if d.noisy_angles else "the band above the motion"


def _caveats(d: Diagnosis) -> list[str]:
    """Return what the runs at hand could not show whatever is missing."""
    noisy = (
        f"{IN_WORDS}, which would let every fit take the machine for too light; looked at below {CUTOFF_HZ:g} Hz: set "
        f"filter.cutoff_hz = {CUTOFF_HZ:g} for the other stages, and see to encoder counts and time stamps"
    )
    hiding = [
        f"the noise floor of {the(joint)} is a guess of {share:.0%} of its "
        f"{d.baseline.machine.joint(joint).effort}, more than any sensor's noise: much of it may be what the model "
        "lacks; record one motion several times over and say its period, and see whether unit, sign and instants of "
        "that channel are right"
        for joint, share in _floor_that_hides(d).items()
    ]
    turning = [_turning(d, one) for one in d.reversals]
    known = [
        f"{effect.label} was told to be there: it is part of what is called rigid body and friction here, and whether "
        "these data show it was not asked"
        for effect in d.baseline.known
    ]
    shown = (hiding + d.upside_down) * (not d.spoilt) + turning
    unreal = [f"no real machine has the extended model's rigid body, so what it is named for is in doubt: {s}"
              for s in d.unrealizable if d.causes and d.lacks_mass]  # fmt: skip
    return known + _untold_length(d) + [noisy] * d.noisy_angles + unreal + shown + _of_one_run(d) + _of_one_kind(d)


def _untold_length(d: Diagnosis) -> list[str]:
    """Say that the distance between two axes is another machine's, which a leg's default is where it was not told."""
    machine, length = d.baseline.machine, d.train[0].motion.geometry.thigh_length_m
    if machine.is_exoskeleton or not machine.mechanism.has_length or length != Geometry().thigh_length_m:
        return []
    return [
        f"nobody told how far apart the axes of {machine.names[0]} and {machine.names[1]} are: taken for "
        f"{length:g} m, an exoskeleton's; set geometry.thigh_length_m in the map, and import again"
    ]


def _reversal(d: Diagnosis, one: BuildUp) -> dict[str, Any]:
    return {
        "joint": one.joint,
        "travel": one.travel,
        "unit": d.baseline.machine.joint(one.joint).unit("angle"),
        "at_once_rmse_nm": one.at_once,
        "otherwise_rmse_nm": one.otherwise,
        "over_travel_rmse_nm": one.over_travel,
    }


def _turning(d: Diagnosis, one: BuildUp) -> str:
    """Say of a joint what the samples tell that the mask leaves out."""
    machine = d.baseline.machine
    joint = machine.joint(one.joint)
    return (
        f"within {NEAR_S:g} s of its reversals, most of it left out of every fit, {the(one.joint)}'s friction "
        f"changes sides over about {1e3 * one.travel:.1g} m{joint.unit('angle')} of travel of its angle as read: "
        f"{PreslidingHysteresis.name}, or play or give between encoder and friction, which are alike there. That takes "
        f"the {joint.effort} error there from {amount(machine, one.joint, one.at_once)}, or "
        f"{amount(machine, one.joint, one.otherwise)} at best without a travel, to "
        f"{amount(machine, one.joint, one.over_travel)} below {CUTOFF_HZ:g} Hz on the runs to validate on; the "
        "model has it change sides at once"
    )


def _floor_that_hides(d: Diagnosis) -> dict[str, float]:
    """Return the joints whose floor is a guess and so high that much could hide in it, with its share of the torque."""
    shares = dict(zip(d.baseline.joints, (d.standing.floor / d.torque_rms).tolist(), strict=True))
    return {} if d.floor.from_periods else {joint: share for joint, share in shares.items() if share > HIDING}


def _of_one_run(d: Diagnosis) -> list[str]:
    """Return what one run to train on cannot show, where nothing is named that it could be."""
    if d.status != "unknown_cause" or d.spoilt or len(d.train) > 1:
        return []
    return [
        "one run alone was trained on: a zero or a tare that is set anew at each start is there the same as one for "
        "all runs; record another to train on, started anew"
    ]


def _of_one_kind(d: Diagnosis) -> list[str]:
    """Return what runs of one kind cannot show."""
    kinds = {run.motion.run for run in d.train}
    if not d.baseline.machine.is_exoskeleton and kinds == {"exo_alone"}:
        return []  # nobody is meant to be in any other machine
    if kinds == {"exo_alone"}:
        return [
            "every run is without a person: what a person adds cannot be seen, and a shifted zero cannot be told from "
            "a mass beside the axis; record with_human runs as well"
        ]
    if kinds == {"with_human"}:
        felt = any(run.motion.forces is not None for run in d.train)
        told = "told from those in the person by the cuff forces alone" if felt else "not told from those in the person"
        return [
            f"every run is with a person: causes in the machine are {told}, and the machine's friction is not known "
            "by itself; record exo_alone runs as well"
        ]
    return []


def _in_short(fault: Fault, d: Diagnosis) -> str:
    others = len(d.faults) - 1
    more = f" (and {others} more fault{'s' * (others > 1)}, in data_faults of verdict.json)" if others else ""
    return f"{fault.file}, {fault.channel}: {fault.what}{more}"


def _finding(d: Diagnosis, causes: list[dict[str, Any]], left: Unknown | None) -> str:
    floor, before, after = d.standing.floor, d.standing.baseline, d.standing.extended
    worst = int((before / floor).argmax())
    joint = d.baseline.joints[worst]
    machine, exerted = d.baseline.machine, d.baseline.machine.joint(joint).effort
    size = f"{amount(machine, joint, before[worst])}, {before[worst] / floor[worst]:.2f} times the noise floor"
    if d.status == "nothing_missing":
        said = f"Nothing is missing that these data could show: the largest {exerted} error, at {the(joint)}, is {size}"
        if not np.isfinite(d.standing.slow_before.floor[worst]):
            return f"{said}, and the runs to validate on are too short to tell whether that is noise."
        hiding = _floor_that_hides(d).get(joint)
        if hiding is None:
            beyond = d.standing.of_a_good_rig(worst)
            if beyond is None:
                return f"{said}."
            return f"{said}. {beyond:.1%} of the {exerted} in it is no noise; even a good rig leaves {IMPERFECT:.1%}."
        return f"{said}, but the floor itself is {hiding:.0%} of the {exerted}: these data could show little."
    if d.status == "unknown_cause":
        described = f" {left.description}" if left else ""
        return (
            "Something is missing, and no cause that exoid knows explains it well enough to be named: "
            f"{the(joint)}'s {exerted} error is {size}.{described}"
        )
    doubts = [f", {doubt[0]}" if (doubt := _doubt(d, cause_label(cause))) else "" for cause in causes]
    named = "; and ".join(_in_words(cause) + doubt for cause, doubt in zip(causes, doubts, strict=True))
    most = int(((before**2 - after**2) / floor**2).argmax())
    of_what_is_left = f" {left.description}" if left and np.any(after > AT_FLOOR * floor) else ""
    joint = d.baseline.joints[most]
    return (
        f"Missing from the simulation: {named}. With {'it' if len(causes) == 1 else 'them'} "
        f"{the(joint)}'s {machine.joint(joint).effort} error falls from {amount(machine, joint, before[most])}, "
        f"{before[most] / floor[most]:.2f} times the noise floor, to {amount(machine, joint, after[most])}, "
        f"{_remains(d, most)}.{of_what_is_left}"
    )


def _remains(d: Diagnosis, told: int) -> str:
    """Say how far the joint told of is from the floor, and at which other joints something stays unexplained."""
    ratio = d.standing.extended / d.standing.floor
    left = [share is not None and share > EXPLAINED for share in d.standing.unexplained]
    said = f"{'still ' if left[told] else ''}{ratio[told]:.2f} times the floor"
    machine = d.baseline.machine
    others = [
        f"; {the(joint)}'s is then {amount(machine, joint, d.standing.extended[j])}, {times:.2f} times its floor"
        for j, (joint, times) in enumerate(zip(d.baseline.joints, ratio, strict=True))
        if left[j] and j != told
    ]
    return (said if ratio[told] > AT_FLOOR else "which is noise") + "".join(others)


def _in_words(cause: dict[str, Any]) -> str:
    """Return a cause, those that could stand in its place, and how probable all of these are together."""
    alike = [in_words(effect_told(one)) for one in (cause, *cause["indistinguishable_from"])]
    likely = f"{cause['probability']:.2f}"
    if len(alike) == 1:
        return f"{alike[0]} (probability {likely})"
    *most, last = [*alike[:MENTIONED], *([f"{len(alike) - MENTIONED} more"] if len(alike) > MENTIONED else [])]
    return f"{', '.join(most)} or {last}, which these data cannot tell apart (together {likely})"
