"""Bars as data: what the error is made of, and what naming the causes took of it."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.contracts.joints import the
from pipelines.errors import InputError
from pipelines.wording.label import SHARES, cause_label, effect_of_cause, in_words, label_in_words
from pipelines.wording.law import LAW

TONES = {
    "noise_floor": "noise",
    "repeatable_unexplained": "left",
    "not_repeatable": "wanders",
    "unexplained": "left",
}
"""Names of the colours of what is no cause."""
CAUSES = 3
"""Colours that there are for causes."""


@dataclass(frozen=True)
class Segment:
    """A part of a bar, from ``low`` to ``high`` of the bar's quantity."""

    key: str
    label: str
    tone: str
    """Name of its colour."""
    low: float
    high: float
    share: float
    """The mean square that it stands for; below zero where a cause raises a joint's error."""

    @property
    def rms(self) -> float:
        """Its root mean square, signed as the share."""
        return float(np.copysign(np.sqrt(abs(self.share)), self.share))


@dataclass(frozen=True)
class Bar:
    """One joint's mean square error, laid end to end."""

    joint: str
    unit: str
    segments: tuple[Segment, ...]

    @property
    def total(self) -> float:
        """The mean square of the whole."""
        return sum(segment.share for segment in self.segments)

    @property
    def rms(self) -> float:
        """Root mean square of the whole."""
        return float(np.sqrt(self.total))

    @property
    def low(self) -> float:
        """Where the bar begins: below zero where a cause makes it worse."""
        return min(0.0, *(segment.low for segment in self.segments))

    @property
    def high(self) -> float:
        """Where it ends."""
        return max(segment.high for segment in self.segments)


@dataclass(frozen=True)
class Fall:
    """One joint's error before and after, beside its noise floor."""

    joint: str
    unit: str
    before: float
    after: float | None
    """None where nothing was named."""
    floor: float
    unexplained: float | None
    """Share of what is above the floor that is left; None where nothing is."""
    torque: float | None = None
    """What was measured; None where a file of an older version does not tell."""

    @property
    def highest(self) -> float:
        """The largest of the three."""
        return max(self.before, self.after or 0.0, self.floor)


def budget(verdict: dict[str, Any]) -> list[Bar]:
    """Return a bar for each joint; what takes away from an error lies left of zero."""
    rows = []
    texts = shares_in_words(verdict)
    for joint, shares in verdict["error_budget"].items():
        left = right = 0.0
        segments = []
        causes = [key for key in shares if key not in SHARES]
        for key, share in shares.items():
            start = right if share >= 0 else left
            tone = TONES[key] if key in TONES else f"cause{1 + causes.index(key) % CAUSES}"
            words = SHARES.get(key) or texts.get(key) or any_label_in_words(key)
            if key == "noise_floor" and share < 0.999 * verdict["noise_floor_nm"][joint] ** 2:
                words = "noise, all of it below the floor"
            segments.append(
                Segment(
                    key, words, tone, min(start, start + share), max(start, start + share), share
                )
            )
            right, left = (right + share, left) if share >= 0 else (right, left + share)
        rows.append(Bar(joint, torque_unit(verdict, joint), tuple(segments)))
    return rows


def falls(verdict: dict[str, Any]) -> list[Fall]:
    """Return each joint's error before and after."""
    named = bool(verdict["causes"])
    return [
        Fall(
            joint,
            torque_unit(verdict, joint),
            before,
            verdict["extended_rmse_nm"][joint] if named else None,
            verdict["noise_floor_nm"][joint],
            verdict["unexplained"][joint],
            (verdict.get("torque_rms_nm") or {}).get(joint),
        )
        for joint, before in verdict["baseline_rmse_nm"].items()
    ]


def torque_unit(verdict: dict[str, Any], joint: str) -> str:
    """Return the unit of a joint's torque or force."""
    return verdict.get("units", {}).get(joint, {}).get("torque", "N·m")


def any_label_in_words(label: str) -> str:
    """Return ``cogging@knee`` as a sentence says it; an effect that is not known here by its
    name."""
    name, _, joint = label.partition("@")
    at = f" at {the(joint)}" if joint else ""
    try:
        return label_in_words(label)
    except (InputError, KeyError):
        return name.removeprefix(LAW).replace("_", " ") + at


def cause_in_words(cause: Mapping[str, Any]) -> str:
    """Return a verdict's cause as a sentence says it: one that differs from run to run as such."""
    try:
        return in_words(effect_of_cause(cause))
    except InputError:
        return any_label_in_words(cause_label(cause))


def shares_in_words(verdict: Mapping[str, Any]) -> dict[str, str]:
    """Return a verdict's causes and those that could stand in their place as sentences say them, by
    label."""
    return {
        cause_label(one): cause_in_words(one)
        for cause in verdict["causes"]
        for one in (*ties_of(cause), cause)
    }


def labels_in_words(text: str, labels: Iterable[str]) -> str:
    """Return a sentence with the labels that stand in it said as sentences say them."""
    known = sorted(set(labels), key=len, reverse=True)
    any_of = (
        re.compile(rf"(?<![\w@])(?:{'|'.join(map(re.escape, known))})(?![\w@])") if known else None
    )
    return any_of.sub(lambda match: any_label_in_words(match[0]), text) if any_of else text


def causes_in_words(causes: Sequence[dict[str, Any]]) -> str:
    """Return the causes of a verdict, most probable first, each with what cannot be told from
    it."""
    words = [tied_in_words(cause) for cause in causes]
    return (", and " if any(map(ties_of, causes)) else " and ").join(words)


def tied_in_words(cause: dict[str, Any]) -> str:
    """Return a cause, or the one that could stand in its place, or how many could."""
    words, ties = cause_in_words(cause), ties_of(cause)
    if not ties:
        return words
    if len(ties) > 1:
        return f"{words} or {len(ties)} others that these data cannot separate"
    other, where = cause_in_words(ties[0]), f" at {the(cause['joint'])}"
    return f"{words.removesuffix(where) if other.endswith(where) else words} or {other}"


def ties_of(cause: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the causes that data of this kind cannot separate from a named one."""
    return list(cause["indistinguishable_from"])
