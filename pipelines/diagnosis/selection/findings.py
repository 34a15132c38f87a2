"""The answer at the depth that the data support: what is missing, from its repeating to its cause.

Findings form a tree: whether it repeats with the motion, at which joint, which family of laws it
belongs to, which cause it is. Each is told at the deepest node whose probability reaches one half.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pipelines.diagnosis.selection.answer import Answer
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior

LIKELY = 0.5
"""Probability from which a node is told."""
CLOSEST = 3
"""Listed causes that are told where none is named."""
Node = tuple[str, Any, float]
"""Level, value and probability of a node of the tree."""
Belongs = Callable[[Element], bool]


@dataclass(frozen=True)
class Finding:
    """One thing that is missing."""

    level: str
    """``repeatability``, ``joint``, ``family`` or ``cause``."""
    repeats: bool | None
    joint: str | None
    family: str | None
    probability: float
    causes: tuple[tuple[str, float], ...]
    """Listed causes that come closest, with their probabilities."""
    path: tuple[Node, ...]
    """The nodes on the way, each within the one above."""

    def as_json(self) -> dict[str, Any]:
        """Return what the verdict says of it."""
        return {
            "level": self.level, "repeats": self.repeats, "joint": self.joint,
            "family": self.family, "probability": self.probability,
            "causes": [_cause(label, p) for label, p in self.causes],
            "path": [
                {"level": level, "value": value, "probability": p} for level, value, p in self.path
            ],
        }  # fmt: skip


def _cause(label: str, probability: float) -> dict[str, Any]:
    effect, _, joint = label.partition("@")
    return {"effect": effect, "joint": joint or None, "probability": probability}


def findings(posterior: Posterior, answer: Answer) -> list[Finding]:
    """Return what is missing, the most probable first; empty where nothing is."""
    missing = 1.0 - posterior.nothing
    if missing < LIKELY:
        return []
    root = ("missing", True, missing)
    told = [_of_cause(posterior, answer, n, root) for n in range(len(answer.named))]
    covered = {(finding.joint, finding.family) for finding in told}
    told += list(_families(posterior, root, covered))
    if not told:
        told += list(_joints(posterior, root)) or [_repeatability(posterior, root)]
    return sorted(told, key=lambda finding: -finding.probability)


def _of_cause(posterior: Posterior, answer: Answer, number: int, root: Node) -> Finding:
    named = answer.named[number]
    element, causes = named.element, ((named.element.label, named.alone), *named.ties)
    labels = {label for label, _ in causes}
    members = [e for e in posterior.elements if e.label in labels]
    path = (root, *_path(posterior, element, members), ("cause", element.label, named.probability))
    return Finding("cause", element.repeats, element.joint, element.family, named.probability, causes, path)


def _path(posterior: Posterior, element: Element, members: Sequence[Element]) -> Iterator[Node]:
    """Yield the nodes that hold all members, each within those above it.

    Tied causes may be of several families or joints: no family or joint then holds them all.
    """
    nodes: list[tuple[str, Any, Belongs]] = [
        ("repeats", element.repeats, lambda e: e.repeats == element.repeats),
        ("joint", element.joint, lambda e: e.joint == element.joint),
        ("family", element.family, lambda e: (e.joint, e.family) == (element.joint, element.family)),
    ]
    above: list[Belongs] = []
    for level, value, belongs in nodes:
        if all(map(belongs, members)):
            above.append(belongs)
            yield level, value, _chance(posterior, *above)


def _families(posterior: Posterior, root: Node, covered: set[tuple[str | None, str | None]]) -> Iterator[Finding]:
    """Yield families at joints that are likely and hold no named cause."""
    for joint, family in dict.fromkeys((e.joint, e.family) for e in posterior.elements):
        if (joint, family) in covered:
            continue

        def belongs(e: Element, joint: str | None = joint, family: str = family) -> bool:
            return (e.joint, e.family) == (joint, family)

        if _chance(posterior, belongs) < LIKELY:
            continue
        first = max(
            (e for e in posterior.elements if belongs(e)),
            key=lambda e: posterior.marginals.get(e.label, 0.0),
        )
        path = (root, *_path(posterior, first, [first]))
        yield Finding("family", first.repeats, joint, family, path[-1][2], _closest(posterior, belongs), path)


def _closest(posterior: Posterior, belongs: Belongs) -> tuple[tuple[str, float], ...]:
    """Return the listed causes that come closest, the most probable first."""
    labels = {e.label for e in posterior.elements if belongs(e) and not e.is_law}
    ranked = [(label, p) for label, p in posterior.marginals.items() if label in labels]
    return tuple(ranked[:CLOSEST])


def _joints(posterior: Posterior, root: Node) -> Iterator[Finding]:
    for joint in dict.fromkeys(e.joint for e in posterior.elements):

        def belongs(e: Element, joint: str | None = joint) -> bool:
            return e.joint == joint

        chance = _chance(posterior, belongs)
        if chance >= LIKELY:
            path = (root, ("joint", joint, chance))
            close = _closest(posterior, belongs)
            yield Finding("joint", None, joint, None, chance, close, path)


def _repeatability(posterior: Posterior, root: Node) -> Finding:
    """Return that something is missing, and whether it repeats where that is likely."""
    chance, repeats = max(
        (_chance(posterior, lambda e: e.repeats), True), (_chance(posterior, lambda e: not e.repeats), False)
    )
    close = _closest(posterior, lambda e: True)
    if chance < LIKELY:
        return Finding("repeatability", None, None, None, root[2], close, (root,))
    path = (root, ("repeats", repeats, chance))
    return Finding("repeatability", repeats, None, None, chance, close, path)


def _chance(posterior: Posterior, *nodes: Belongs) -> float:
    """Return the probability that some element of the true set lies within all nodes."""
    inside = {i for i, e in enumerate(posterior.elements) if all(node(e) for node in nodes)}
    pairs = zip(posterior.sets, posterior.probabilities, strict=True)
    return float(sum(p for chosen, p in pairs if not inside.isdisjoint(chosen)))
