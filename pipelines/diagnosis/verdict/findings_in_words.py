"""``findings`` of the verdict: what is missing at the depth that the data support, in words.

A node of a finding's path holds whatever could be the answer. Where tied causes belong to several
families or joints, no family or joint holds them all, so the path has no such node.
"""

from collections.abc import Callable, Iterator
from typing import Any

from pipelines.contracts.joints import the
from pipelines.diagnosis.candidates.smooth_laws import IN_WORDS
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.findings import Finding
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.label import effect_labelled, in_words

FAMILIES = {
    "angle": "a law of {joint}'s angle",
    "speed": "a law of {joint}'s speed",
    "reversal": "friction of {joint} that remembers its reversals",
    "load": "a law of {joint}'s load",
    "time": "a torque at {joint} that changes with time",
    "transmission": "something in {joint}'s transmission",
    "sensor": "something in {joint}'s sensors",
    "person": "something of the person at {joint}",
}
"""What is missing, known by its family alone."""
LAW = "law:"
"""What the label of an unlisted law begins with."""
WORTH_A_LINE = 0.01
"""Probability below which a law is not listed with a finding."""


def findings(d: Diagnosis) -> list[dict[str, Any]]:
    """Return the findings as JSON objects, each with its words and the unlisted laws beside it."""
    weighed = d.selected.posterior
    return [] if weighed is None else [_as_json(d, one, weighed) for one in d.selected.findings]


def thing(finding: Finding) -> str:
    """Return what is missing where no cause is named, as deep as it is known."""
    if finding.level == "family":
        return _family(finding.family, finding.joint)
    if finding.level == "joint":
        return _something_at(finding.joint)
    if finding.repeats is None:
        return "something that may repeat with the motion or not"
    return _something_that_repeats(finding.repeats)


def label_in_words(label: str) -> str:
    """Return a cause, or an unlisted law by its label, as a sentence says it."""
    if not label.startswith(LAW):
        return in_words(effect_labelled(label))
    kind, joint = _law_of(label)
    return IN_WORDS[kind].format(joint=the(joint))


def family_of(label: str, weighed: Posterior) -> str:
    """Return the family of a label that was weighed."""
    return next(element.family for element in weighed.elements if element.label == label)


def _as_json(d: Diagnosis, finding: Finding, weighed: Posterior) -> dict[str, Any]:
    told = finding.as_json()
    for cause, (label, _) in zip(told["causes"], finding.causes, strict=True):
        effect = d.effects.get(label) or d.effect_of(label)
        cause |= {"family": family_of(label, weighed), "words": in_words(effect)}
    path = [node for node in told["path"] if _holds_all(node, finding, weighed)]
    for node in path:
        node["words"] = _node_in_words(node, finding)
    words = told["causes"][0]["words"] if finding.level == "cause" else thing(finding)
    return told | {"words": words, "path": path, "laws": list(_laws(finding, weighed))}


def _node_in_words(node: dict[str, Any], finding: Finding) -> str:
    level, value = node["level"], node["value"]
    if level == "missing":
        return "something is missing"
    if level == "repeats":
        return _something_that_repeats(value)
    if level == "joint":
        return _something_at(value)
    return _family(value, finding.joint) if level == "family" else label_in_words(value)


def _something_that_repeats(repeats: bool) -> str:
    return f"something that {'repeats' if repeats else 'does not repeat'} with the motion"


def _something_at(joint: str | None) -> str:
    return f"something at {the(joint)}" if joint else "something of no single joint"


def _family(family: str | None, joint: str | None) -> str:
    return FAMILIES[str(family)].format(joint=the(joint) if joint else "the machine")


def _law_of(label: str) -> tuple[str, str]:
    """Return kind and joint of an unlisted law's label."""
    kind, _, joint = label.removeprefix(LAW).partition("@")
    return kind, joint


def _belongs(level: str, finding: Finding) -> Callable[[Element], bool]:
    """Return whether an element belongs to the node of a level on a finding's path."""
    if level == "repeats":
        return lambda e: e.repeats == finding.repeats
    if level == "joint":
        return lambda e: e.joint == finding.joint
    if level == "family":
        return lambda e: (e.joint, e.family) == (finding.joint, finding.family)
    return lambda e: True


def _holds_all(node: dict[str, Any], finding: Finding, weighed: Posterior) -> bool:
    """Tell whether a node holds the named cause and all that are tied with it."""
    if finding.level != "cause":
        return True
    labels, belongs = dict(finding.causes), _belongs(node["level"], finding)
    return all(belongs(e) for e in weighed.elements if e.label in labels)


def _laws(finding: Finding, weighed: Posterior) -> Iterator[dict[str, Any]]:
    """Yield the unlisted laws of the finding's deepest node above a cause."""
    belongs = _belongs("family" if finding.level == "cause" else finding.level, finding)
    labels = {e.label for e in weighed.elements if e.is_law and belongs(e)}
    for label, p in weighed.marginals.items():
        if label in labels and p >= WORTH_A_LINE:
            kind, joint = _law_of(label)
            yield {"law": kind, "joint": joint, "probability": p, "words": label_in_words(label)}
