"""``Criteria.look_alike`` learned from a blind examination on seeds for tuning."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from pipelines.diagnosis.candidates.smooth_laws import FAMILIES
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.look_alikes import IN_WORDS, listed_share
from pipelines.model import effect_named
from tests.blind.scoring import names_of
from tests.blind.statistics import brier, calibration_error

PENALTY = 0.01
"""Of squared criteria, so that causes that are all right or all wrong give finite ones."""


class Judged(NamedTuple):
    """A cause that was asked whether it is a look-alike."""

    probability: float
    """Before it was asked."""
    removed: float
    """Share of the systematic error that it removes."""
    instead: float
    """Probability of smooth laws of its family and joint in its place, over its own."""
    is_right: bool


def judged_causes(root: Path) -> Iterator[Judged]:
    """Yield the causes that an examination's answers, in a folder, asked about."""
    for path in sorted((root / "truth").glob("*.json")):
        answer = root / "answers" / path.stem / "answer.json"
        verdict = json.loads(answer.read_text())["verdict"] if answer.exists() else None
        truth = json.loads(path.read_text())
        if verdict and verdict["posterior"] and truth["case"]["category"] != "fault":
            yield from _judged(truth, verdict)


def _judged(truth: dict[str, Any], verdict: dict[str, Any]) -> Iterator[Judged]:
    there = {(name, h["joint"]) for h in truth["hidden"] for name in (h["effect"], *h["kin"])}
    named, posterior = {_label(cause): cause for cause in verdict["causes"]}, verdict["posterior"]
    for label, removed in posterior["systematic_error_removed"].items():
        effect, _, joint = label.partition("@")
        cause = named.get(label, {"effect": effect, "joint": joint or None, "probability": posterior["causes"][label]})
        places = {(str(effect_named(name).family), at) for name, at in names_of(cause)}
        given, instead = (_unlisted(posterior["laws"], places, is_look_alike) for is_look_alike in (True, False))
        before = min(cause["probability"] + given, 1.0)
        yield Judged(before, removed, instead / before, bool(there & names_of(cause)))


def _unlisted(laws: dict[str, float], places: set[tuple[str, str | None]], is_look_alike: bool) -> float:
    """Return the probability of unlisted laws of families and joints: of look-alikes, or of smooth laws."""
    kinds = {kind: kind.removeprefix("unlisted_") for kind in IN_WORDS} if is_look_alike else FAMILIES
    found = 0.0
    for label, p in laws.items():
        kind, _, joint = label.removeprefix("law:").partition("@")
        if (kinds.get(kind), joint or None) in places:
            found += p
    return found


def _label(cause: dict[str, Any]) -> str:
    return f"{cause['effect']}@{cause['joint']}" if cause["joint"] else str(cause["effect"])


def learn_look_alike(judged: Sequence[Judged]) -> dict[str, Any]:
    """Return the criteria that give the truth of judged causes most probability, and what they are worth."""
    p, removed, instead, is_right = (np.array(column, dtype=float) for column in zip(*judged, strict=True))

    def likely(criteria: NDArray) -> NDArray:
        return np.clip(p * listed_share(removed, instead, criteria), 1e-9, 1.0 - 1e-9)

    def loss(criteria: NDArray) -> float:
        told = likely(criteria)
        fitted = np.where(is_right > 0.0, np.log(told), np.log1p(-told)).sum()
        return float(PENALTY * criteria @ criteria - fitted)

    found = minimize(loss, np.array(CRITERIA.look_alike), method="L-BFGS-B", bounds=[(None, None), (0.0, None)])
    worth = {
        name: _worth(likely(np.array(criteria)) if criteria is not None else p, is_right)
        for name, criteria in (("without", None), ("now", CRITERIA.look_alike), ("learned", found.x))
    }
    return {"causes": len(p), "look_alike": [float(x) for x in found.x], **worth}


def _worth(told: NDArray, is_right: NDArray) -> dict[str, float | None]:
    pairs = [(float(p), bool(right)) for p, right in zip(told, is_right, strict=True)]
    likely = np.where(is_right > 0.0, np.clip(told, 1e-9, 1.0), np.clip(1.0 - told, 1e-9, 1.0))
    return {
        "mean_log": float(np.mean(np.log(likely))),
        "brier": brier(pairs),
        "calibration_error": calibration_error(pairs),
    }
