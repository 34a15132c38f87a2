"""A verdict's findings as rows to be shown: the missing physics and its probability.

For terminal and report alike, from the keys ``findings``, ``router`` and ``posterior`` of a
verdict; files of older versions lack these, and then nothing is shown.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipelines.contracts.verdict import Finding, Verdict
    from pipelines.contracts.verdict import Node as Step


@dataclass(frozen=True)
class Outcome:
    """One of three cases of which exactly one is so."""

    key: str
    words: str
    """The case in words."""
    probability: float
    """Rounded to hundredths, so that the three add up to one as they are shown."""


@dataclass
class Node:
    """Missing physics at some depth: that something is missing, where, which family or cause."""

    words: str
    probability: float
    is_answer: bool = False
    """Whether it is the deepest that the data support."""
    below: dict[Any, "Node"] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """A line of the tree of findings."""

    depth: int
    words: str
    probability: float
    is_answer: bool


@dataclass(frozen=True)
class Shares:
    """Parts of one joint's residual, and the share that one variable alone predicts."""

    joint: str
    rms: float
    parts: dict[str, float]
    """Shares of the mean square by the router's names; they add up to one."""
    with_person_only: float | None
    """Share that repeats only with the person."""
    predicted: dict[str, float]
    """Share of the variance that a curve of one variable predicts; these overlap."""


PARTS = {
    "noise": "noise",
    "repeats": "repeats with the motion",
    "wanders": "wanders from period to period",
    "between_runs": "differs from run to run",
    "unsplit": "more than noise, and no periods to compare",
}
"""The router's parts in words, as they are shown."""
VARIABLES = ("angle", "speed", "load", "time", "tone")
"""Variables whose share is shown."""


def outcomes(verdict: "Verdict") -> tuple[Outcome, ...]:
    """Return the three cases and their probabilities; empty where no cause was sought."""
    posterior = verdict.posterior
    if posterior is None:
        return ()
    nothing, unlisted = round(posterior.nothing_missing, 2), round(posterior.unlisted, 2)
    # Three numbers rounded on their own may add up to 0.99 or 1.01, so the last is the remainder.
    listed = round(max(1.0 - nothing - unlisted, 0.0), 2)
    return (
        Outcome("nothing", "nothing", nothing),
        Outcome("listed", "listed causes only", listed),
        Outcome("unlisted", "something unlisted", round(1.0 - nothing - listed, 2)),
    )


def rows(verdict: "Verdict") -> list[Row]:
    """Return the tree of findings, each node above its branches; empty without findings."""
    root = Node("", 1.0)
    for finding in verdict.findings:
        _grow(root, finding)
    return [row for node in root.below.values() for row in _rows_of(node, 0)]


def searched_runs(verdict: "Verdict") -> str:
    """Return which runs causes were sought on, whose residual is split."""
    return "all runs" if verdict.sought_on == "all" else "training runs"


def shares(verdict: "Verdict") -> list[Shares]:
    """Return how each joint's residual splits."""
    rows = []
    # A sliding joint has a position; `depends_on` names every coordinate an angle.
    slides = all(of["angle"] == "m" for of in verdict.units.values())
    names = {"angle": "position"} if slides else {}
    for joint, router in verdict.router.items():
        depends = {one.variable: one.share_before for one in verdict.depends_on[joint]}
        shown = [name for name in VARIABLES if name in depends]
        predicted = {names.get(name, name): depends[name] for name in shown}
        parts = {part: getattr(router, part) or 0.0 for part in PARTS}
        rows.append(Shares(joint, router.rms_nm, parts, router.with_person_only, predicted))
    return rows


def _grow(root: Node, finding: "Finding") -> None:
    """Add a finding's path to the tree, and the possible answers at its end."""
    node, is_cause = root, finding.level == "cause"
    path = finding.path
    # That something is missing is one of the outcomes; it is a line only where no more is known.
    for one in path[1 : len(path) - is_cause] or path[: 1 - is_cause]:
        node = _under(node, (one.level, one.value), one.words, one.probability)
    others = [(f"unlisted: {law.words}", law.probability) for law in finding.laws]
    if is_cause:
        _answer(node, path[-1], finding)
    else:
        node.is_answer = True
        against = ", not named: the validation runs speak against it"
        causes = [(one.words + against * one.dropped, one.probability) for one in finding.causes]
        others = causes + others
    # Probability below which an alternative is not shown.
    least = 0.01
    for words, probability in others:
        if probability >= least:
            _under(node, words, words, probability)


def _answer(node: Node, last: "Step", finding: "Finding") -> None:
    """Add a named cause, with those that are tied with it below one line for all of them."""
    first, *ties = finding.causes
    # A tie cannot be decided, so the probability is of all its members together.
    words = "one of these, which these data cannot separate" if ties else first.words
    here = _under(node, (last.level, last.value), words, finding.probability)
    here.is_answer = True
    if ties:
        for cause in finding.causes:
            _under(here, cause.words, cause.words, cause.probability)


def _under(node: Node, key: Any, words: str, probability: float) -> Node:
    return node.below.setdefault(key, Node(words, probability))


def _rows_of(node: Node, depth: int) -> Iterator[Row]:
    yield Row(depth, node.words, node.probability, node.is_answer)
    for below in node.below.values():
        yield from _rows_of(below, depth + 1)
