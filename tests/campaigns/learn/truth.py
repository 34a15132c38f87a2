"""The right answers of one session: sets of labels, from its truth file."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pipelines.wording.law import LAWS, family_of_kind, kind_and_joint

ALIKE = (
    {"torque_offset", "coulomb_asymmetry"},
    {"base_tilt", "encoder_offset"},
)
"""Causes that no data can separate, at one joint."""
NOTHING = ("none", "imperfect")

Right = Callable[[frozenset[str]], bool]


def right_sets(truth: Mapping[str, Any]) -> Right:
    """Return a function of a set of labels: whether it is the truth."""
    category = truth["case"]["category"]
    if category in NOTHING:
        return lambda labels: not labels
    if category == "outside":
        return _outside(truth)
    hidden = [label_of(h) for h in truth["hidden"]]
    accepted = [{label, *_tied(label, truth)} for label in hidden]
    return lambda labels: len(labels) == len(hidden) and _matched(labels, accepted)


def label_of(hidden: Mapping[str, Any]) -> str:
    """Return ``effect@joint`` of something hidden."""
    joint = hidden["joint"]
    return hidden["effect"] if joint is None else f"{hidden['effect']}@{joint}"


def _matched(labels: Iterable[str], accepted: list[set[str]]) -> bool:
    """Return whether each label stands for another of the hidden causes."""
    remaining = list(accepted)
    for label in labels:
        fitting = next((own for own in remaining if label in own), None)
        if fitting is None:
            return False
        remaining.remove(fitting)
    return True


def _tied(label: str, truth: Mapping[str, Any]) -> set[str]:
    """Return labels that no data of this session can separate from one."""
    name, _, joint = label.partition("@")
    tied = set()
    for names in ALIKE:
        if name not in names:
            continue
        for other in names - {name}:
            tied.add("base_tilt" if other == "base_tilt" else f"{other}@{joint or 'hip'}")
    return {
        t for t in tied if not (name == "encoder_offset" and joint != "hip" and t == "base_tilt")
    }


def _outside(truth: Mapping[str, Any]) -> Right:
    """Return what accepts sets with an unlisted law of the right family, or its kin."""
    (hidden,) = truth["hidden"]
    families = set(hidden.get("families") or {family for family, _ in LAWS.values()})
    kin = {f"{name}@{hidden['joint']}" for name in hidden["kin"]}

    def right(labels: frozenset[str]) -> bool:
        laws = {label for label in labels if label.startswith("law:")}
        if labels and labels <= kin:
            return True
        known = labels - laws
        return bool(laws) and known <= kin and any(_family(law) in families for law in laws)

    return right


def _family(law: str) -> str:
    return family_of_kind(kind_and_joint(law)[0])
