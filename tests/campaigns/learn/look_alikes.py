"""``Criteria.look_alike`` learned from a blind examination on seeds for tuning."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from pipelines.contracts.verdict import EffectAtJoint
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.unlisted_look_alikes import kept_share
from pipelines.model import effect_named
from pipelines.wording.law import UNLISTED, family_of_kind, kind_and_joint
from tests.campaigns.blind.scoring import names_of
from tests.campaigns.blind.statistics import brier, calibration_error

PENALTY = 0.01
"""Weight of squared criteria; keeps them finite where all causes are right or all wrong."""


class JudgedCause(NamedTuple):
    """A cause that was asked whether it is a look-alike."""

    probability: float
    """Before it was asked."""
    removed: float
    """Share of the systematic error that it removes."""
    smooth_law_ratio: float
    """Probability of smooth laws of its family and joint in its place, over its own."""
    is_right: bool


def judged_causes(root: Path) -> Iterator[JudgedCause]:
    """Yield the causes that an examination's answers, in a folder, asked about."""
    for path in sorted((root / "truth").glob("*.json")):
        answer = root / "answers" / path.stem / "answer.json"
        verdict = json.loads(answer.read_text())["verdict"] if answer.exists() else None
        truth = json.loads(path.read_text())
        # In cross-validation a resemblance removes more: the unseen half has the same motion.
        held_out = verdict and verdict.get("fitted_to", "train") == "train"
        if held_out and verdict["posterior"] and truth["case"]["category"] != "fault":
            yield from _judged(truth, verdict)


def _judged(truth: dict[str, Any], verdict: dict[str, Any]) -> Iterator[JudgedCause]:
    there = {(name, h["joint"]) for h in truth["hidden"] for name in (h["effect"], *h["kin"])}
    named, posterior = (
        {EffectAtJoint.model_validate(cause).label: cause for cause in verdict["causes"]},
        verdict["posterior"],
    )
    for label, removed in posterior["systematic_error_removed"].items():
        effect, _, joint = label.partition("@")
        cause = named.get(
            label,
            {"effect": effect, "joint": joint or None, "probability": posterior["causes"][label]},
        )
        places = {(str(effect_named(name).family), at) for name, at in names_of(cause)}
        look_alikes, smooth_laws = _probabilities(posterior["laws"], places)
        before = min(cause["probability"] + look_alikes, 1.0)
        yield JudgedCause(before, removed, smooth_laws / before, bool(there & names_of(cause)))


def _probabilities(
    laws: dict[str, float], places: set[tuple[str, str | None]]
) -> tuple[float, float]:
    """Return the probability of look-alikes of families and joints, and of smooth laws."""
    look_alikes = smooth_laws = 0.0
    for label, p in laws.items():
        kind, joint = kind_and_joint(label)
        if (family_of_kind(kind), joint) in places:
            if kind.startswith(UNLISTED):
                look_alikes += p
            else:
                smooth_laws += p
    return look_alikes, smooth_laws


def learn_look_alike(judged: Sequence[JudgedCause]) -> dict[str, Any]:
    """Return the criteria that give the truth of judged causes most probability, and what they are
    worth."""
    p, removed, ratio, right = (np.array(column) for column in zip(*judged, strict=True))

    def likely(criteria: NDArray) -> NDArray:
        return np.clip(p * kept_share(removed, ratio, criteria), 1e-9, 1.0 - 1e-9)

    def loss(criteria: NDArray) -> float:
        probability = likely(criteria)
        fitted = np.where(right, np.log(probability), np.log1p(-probability)).sum()
        return float(PENALTY * criteria @ criteria - fitted)

    # A cause that removes more is never more likely to be a look-alike: the slope is not negative.
    minimum = minimize(
        loss, np.array(CRITERIA.look_alike), method="L-BFGS-B", bounds=[(None, None), (0.0, None)]
    )
    worth = {
        name: _worth(likely(np.array(criteria)) if criteria is not None else p, right)
        for name, criteria in (
            ("without", None),
            ("now", CRITERIA.look_alike),
            ("learned", minimum.x),
        )
    }
    return {"causes": len(p), "look_alike": [float(x) for x in minimum.x], **worth}


def _worth(probability: NDArray, right: NDArray) -> dict[str, float | None]:
    pairs = [(float(p), bool(true)) for p, true in zip(probability, right, strict=True)]
    likely = np.clip(np.where(right, probability, 1.0 - probability), 1e-9, 1.0)
    return {
        "mean_log": float(np.mean(np.log(likely))),
        "brier": brier(pairs),
        "calibration_error": calibration_error(pairs),
    }
