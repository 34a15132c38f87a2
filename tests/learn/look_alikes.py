"""``Criteria.look_alike`` learned from a blind examination on seeds for tuning."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.look_alikes import LEAST, listed_probability
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
    named = {_label(cause): cause for cause in verdict["causes"]}
    for label, removed in verdict["posterior"]["systematic_error_removed"].items():
        effect, _, joint = label.partition("@")
        cause = named.get(label, {"effect": effect, "joint": joint or None, "probability": None})
        now = cause["probability"] or verdict["posterior"]["causes"][label]
        yield Judged(min(now / listed_probability(removed), 1.0), removed, bool(there & names_of(cause)))


def _label(cause: dict[str, Any]) -> str:
    return f"{cause['effect']}@{cause['joint']}" if cause["joint"] else str(cause["effect"])


def learn_look_alike(judged: Sequence[Judged]) -> dict[str, Any]:
    """Return the criteria that give the truth of judged causes most probability, and what they are worth."""
    p, removed, is_right = (np.array(column, dtype=float) for column in zip(*judged, strict=True))
    logs = np.log(np.maximum(removed, LEAST))

    def likely(criteria: NDArray) -> NDArray:
        return np.clip(p * expit(criteria[0] + criteria[1] * logs), 1e-9, 1.0 - 1e-9)

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
