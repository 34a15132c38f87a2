"""Report missing physics as precisely as the data support, from its repeating to its cause.

Findings form a tree: whether it repeats with the motion, at which joint, which family of laws it
belongs to, which cause it is. Each is reported at the deepest node whose probability reaches one
half.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.answer import Answer, NamedCause
from pipelines.diagnosis.selection.posterior import Posterior

LEVELS = ("repeats", "joint", "family")
"""From the root to the causes: attributes of elements."""
Inside = frozenset[int]
"""Numbers of the elements in a node."""


@dataclass(frozen=True)
class Finding:
    """One thing that is missing."""

    level: str
    """``repeatability``, ``joint``, ``family`` or ``cause``."""
    repeats: bool | None
    joint: str | None
    family: str | None
    probability: float
    """Of a cause with its ties, or of something in the deepest node in addition to other
    findings."""
    causes: tuple[tuple[str, float], ...]
    """With probabilities: at level ``cause`` the named one and its ties, else the closest listed
    causes."""
    laws: tuple[tuple[str, float], ...]
    """Unlisted laws in the deepest node above a cause, with their probabilities."""
    path: tuple[tuple[str, Any, float], ...]
    """Level, value and probability of each node on the way, each within the one before it.

    Where tied causes belong to several families or joints, none holds all, and none is on the path.
    """

    def as_json(self) -> dict[str, Any]:
        """Return its entry in the verdict."""
        return {
            "level": self.level,
            "repeats": self.repeats,
            "joint": self.joint,
            "family": self.family,
            "probability": self.probability,
            "causes": [_cause(label, p) for label, p in self.causes],
            "path": [
                {"level": level, "value": value, "probability": p} for level, value, p in self.path
            ],
        }


def _cause(label: str, probability: float) -> dict[str, Any]:
    effect, _, joint = label.partition("@")
    return {"effect": effect, "joint": joint or None, "probability": probability}


def findings(posterior: Posterior, answer: Answer) -> list[Finding]:
    """Return the missing causes, the most probable first; empty where the model is complete."""
    if 1.0 - posterior.nothing < CRITERIA.named_from:
        return []
    results = [_of_cause(posterior, named) for named in answer.named]
    # Elements that a named cause or its ties stand for are not reported a second time.
    named = {label for one in results for label, _ in one.causes}
    rest = frozenset(
        i for i, element in enumerate(posterior.elements) if element.label not in named
    )
    results += _remainder(posterior, rest)
    return sorted(results, key=lambda finding: -finding.probability)


def _of_cause(posterior: Posterior, named: NamedCause) -> Finding:
    element = named.element
    alternatives = ((element.label, named.alone), *named.ties)
    labels = dict(alternatives)
    members = [one for one in posterior.elements if one.label in labels]
    # A level on which ties differ would hold a part of their probability only.
    shared = {
        level: getattr(element, level)
        for level in LEVELS
        if all(getattr(one, level) == getattr(element, level) for one in members)
    }
    family = _within(posterior, {"joint": element.joint, "family": element.family})
    return Finding(
        "cause",
        element.repeats,
        element.joint,
        element.family,
        named.probability,
        alternatives,
        tuple(_ranked(posterior, family, are_laws=True)),
        (*_path(posterior, shared), ("cause", element.label, named.probability)),
    )


def _remainder(posterior: Posterior, rest: Inside) -> Iterator[Finding]:
    """Yield the likely findings among elements that no named cause stands for, deepest first."""
    elements = posterior.elements
    families = [{"joint": e.joint, "family": e.family} for e in elements]
    joints = [{"joint": e.joint} for e in elements]
    anything: dict[str, Any] = {}
    for nodes in (families, joints, [anything]):
        covered: Inside = frozenset()
        for node in {tuple(node.items()): node for node in nodes}.values():
            for finding, inside in _likely(posterior, rest, node):
                yield finding
                covered |= inside
        # The next level up reports only elements that no finding covers yet.
        rest -= covered


def _likely(
    posterior: Posterior, rest: Inside, node: Mapping[str, Any]
) -> Iterator[tuple[Finding, Inside]]:
    """Yield the likely findings of a node, and the elements of each.

    Whether it repeats is left out where neither is likely.
    """
    for nodes in ([{"repeats": r, **node} for r in (True, False)], [node]):
        likely = []
        for one in nodes:
            inside = _within(posterior, one) & rest
            probability = _chance(posterior, inside)
            if probability >= CRITERIA.named_from:
                likely.append((_finding(posterior, one, inside, probability), inside))
        if likely:
            yield from likely
            return


def _finding(
    posterior: Posterior, node: Mapping[str, Any], inside: Inside, probability: float
) -> Finding:
    """Return the finding that one of these elements within a node is missing."""
    deepest = [level for level in LEVELS if level in node] or ["repeats"]
    # Largest number of listed causes that are reported where none is named.
    most = 3
    return Finding(
        "repeatability" if deepest[-1] == "repeats" else deepest[-1],
        node.get("repeats"),
        node.get("joint"),
        node.get("family"),
        probability,
        tuple(_ranked(posterior, inside, are_laws=False))[:most],
        tuple(_ranked(posterior, inside, are_laws=True)),
        _path(posterior, node),
    )


def _path(posterior: Posterior, node: Mapping[str, Any]) -> tuple[tuple[str, Any, float], ...]:
    """Return the path to a node, given by its value at some levels."""
    path: list[tuple[str, Any, float]] = [("missing", True, 1.0 - posterior.nothing)]
    above: dict[str, Any] = {}
    for level in LEVELS:
        if level in node:
            above[level] = node[level]
            path.append((level, node[level], _chance(posterior, _within(posterior, above))))
    return tuple(path)


def _within(posterior: Posterior, node: Mapping[str, Any]) -> Inside:
    """Return the elements that have a node's values."""
    pairs = enumerate(posterior.elements)
    return frozenset(
        i for i, e in pairs if all(getattr(e, level) == value for level, value in node.items())
    )


def _ranked(posterior: Posterior, inside: Inside, *, are_laws: bool) -> Iterator[tuple[str, float]]:
    """Yield the labels of causes or laws with probabilities, the most probable first."""
    labels = {
        posterior.elements[i].label for i in inside if posterior.elements[i].is_law == are_laws
    }
    return ((label, p) for label, p in posterior.marginals.items() if label in labels)


def _chance(posterior: Posterior, inside: Inside) -> float:
    """Return the probability that the true set has at least one of these elements."""
    pairs = zip(posterior.sets, posterior.probabilities, strict=True)
    # Rounding may make a sum of probabilities slightly larger than one.
    return min(float(sum(p for chosen, p in pairs if not inside.isdisjoint(chosen))), 1.0)
