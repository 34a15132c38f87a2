"""Build ``findings`` of the verdict: the missing physics, as precisely as the data support."""

from collections.abc import Iterator
from typing import Any

from pipelines.contracts.joints import the
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.selection.findings import Finding
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.mechanics.machine import Machine
from pipelines.wording.label import in_words
from pipelines.wording.law import family_in_words, is_of_other_joint, kind_and_joint, law_in_words


def findings(d: Diagnosis) -> list[dict[str, Any]]:
    """Return the findings as JSON objects, each with its words and its unlisted laws."""
    weighed = d.selected.posterior
    return [] if weighed is None else [_as_json(d, one, weighed) for one in d.selected.findings]


def family_of(label: str, weighed: Posterior) -> str:
    """Return the family of a label that was weighed."""
    return next(element.family for element in weighed.elements if element.label == label)


def _as_json(d: Diagnosis, finding: Finding, weighed: Posterior) -> dict[str, Any]:
    entry, machine = finding.as_json(), d.baseline.machine
    against = d.selected.dropped
    for cause, (label, _) in zip(entry["causes"], finding.causes, strict=True):
        # A named cause has fitted values; another one has those of the library.
        effect = d.effects.get(label) or d.effect_of(label)
        cause |= {
            "family": family_of(label, weighed),
            "words": in_words(effect),
            "dropped": label in against,
        }
    # The most probable law has the joint whose angle, speed or load it is.
    law, p = next(iter(finding.laws), ("", 0.0))
    of_other_joint = p >= CRITERIA.named_from and is_of_other_joint(law)
    for node in entry["path"]:
        node["words"] = _node_in_words(d, node, entry, of_other_joint)
    entry["laws"] = list(_laws(finding, machine))
    last = entry["path"][-1]["words"]
    # If it is unknown whether it repeats, the path has its first node only.
    entry["words"] = last if len(entry["path"]) > 1 else "something that may repeat or not"
    return entry


def _node_in_words(
    d: Diagnosis, node: dict[str, Any], finding: dict[str, Any], of_other_joint: bool
) -> str:
    level, value = node["level"], node["value"]
    if level == "missing":
        return "something is missing"
    if level == "repeats":
        if not d.has_periods:
            return f"something that {'depends' if value else 'does not depend'} on the motion"
        return f"something that {'repeats' if value else 'does not repeat'} with the motion"
    if level == "joint":
        return f"something at {the(value)}" if value else "something of no single joint"
    if level == "family":
        return family_in_words(
            value, finding["joint"], d.baseline.machine, of_other_joint=of_other_joint
        )
    return str(finding["causes"][0]["words"])


def _laws(finding: Finding, machine: Machine) -> Iterator[dict[str, Any]]:
    """Yield the unlisted laws of a finding that are worth a line."""
    # Probability below which a law is not listed with a finding.
    least = 0.01
    for label, p in finding.laws:
        if p >= least:
            kind, joint = kind_and_joint(label)
            yield {
                "law": kind,
                "joint": joint,
                "probability": p,
                "words": law_in_words(label, machine),
            }
