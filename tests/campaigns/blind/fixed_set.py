"""The fixed set that CI examines, and the record of how each of its cases came out.

The set is chosen by number alone: every cause once, hip and knee in turn, then the first few of
each other category. ``fixed_set.json`` holds what came out;
``python -m tests.campaigns.blind --fixed --write`` rewrites it.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.campaigns.blind.cases import PLAIN_SINGLES, Case, case
from tests.campaigns.blind.causes import joints_of
from tests.campaigns.blind.scoring import Score
from tests.campaigns.blind.seeds import RANGES
from tests.campaigns.blind.tables import label

OTHERS = {"none": 4, "imperfect": 3, "pair": 4, "outside": 4, "fault": 3}
"""How many cases that do not hide a single effect."""
SILENT_IS_RIGHT = ("none", "imperfect")
RECORD = Path(__file__).with_suffix(".json")
REWRITE = "make blind-fixed"
MOST_DIFFERENT = 2
MOST_LOST = 1


@dataclass(frozen=True)
class Outcome:
    """How one case came out."""

    seed: int
    hidden: str
    status: str
    first: str | None
    """First cause named, with its joint."""
    right: bool


def fixed_set() -> list[Case]:
    """Return the cases of the fixed set."""
    places = [(effect, joints_of(effect)) for effect in dict(PLAIN_SINGLES)]
    singles = [
        PLAIN_SINGLES.index((effect, joints[i % len(joints)]))
        for i, (effect, joints) in enumerate(places)
    ]
    turns = [("single", turn) for turn in singles]
    turns += [(category, turn) for category, count in OTHERS.items() for turn in range(count)]
    return [
        case(RANGES["fixed"].start + k, category, turn, plain=True)
        for k, (category, turn) in enumerate(turns)
    ]


def outcomes(cases: Iterable[Case], scores: Iterable[Score]) -> list[Outcome]:
    """Return how the cases came out, in their order; scores come in any."""
    by_seed = {s.seed: s for s in scores}
    pairs = [(c, by_seed[c.seed]) for c in cases]
    return [
        Outcome(c.seed, c.label, s.status, label(s.named[0]) if s.named else None, s.right)
        for c, s in pairs
    ]


def write(outcomes_now: Sequence[Outcome], path: Path = RECORD) -> None:
    """Record how the set came out, a case a line."""
    lines = ",\n".join(f"  {json.dumps(asdict(outcome))}" for outcome in outcomes_now)
    path.write_text(f'{{"right": {sum(o.right for o in outcomes_now)}, "cases": [\n{lines}\n]}}\n')


def read(path: Path = RECORD) -> list[Outcome]:
    """Read the record."""
    return [Outcome(**row) for row in json.loads(path.read_text())["cases"]]


def complaints(recorded: Sequence[Outcome], present: Sequence[Outcome]) -> list[str]:
    """Say what is not as recorded, a line each; nothing where all is well.

    Rounding differs between machines, and where two causes or a threshold are close it decides. So
    of the cases at most two may differ in whether they are right or in the first cause, and at most
    one right answer may be lost. Two things are never allowed: a new false alarm, and a case that
    has become right, which belongs into the record lest it be lost again unnoticed. Once recorded,
    a machine whose rounding makes it wrong is within what is allowed.
    """
    if [(o.seed, o.hidden) for o in recorded] != [(o.seed, o.hidden) for o in present]:
        return [f"{RECORD.name} has other cases than the fixed set: rewrite it by `{REWRITE}`"]
    changes = [
        (was, now)
        for was, now in zip(recorded, present, strict=True)
        if _essence(was) != _essence(now)
    ]
    better = [_change(*c) for c in changes if c[1].right and not c[0].right]
    alarms = [
        _change(*c)
        for c in changes
        if c[0].right and not c[1].right and c[1].hidden in SILENT_IS_RIGHT
    ]
    other = [words for words in (_change(*c) for c in changes) if words not in better]
    were, are = (sum(o.right for o in which) for which in (recorded, present))
    words = [
        f"{change}: better than recorded; rewrite {RECORD.name} by `{REWRITE}`" for change in better
    ]
    words += [f"{change}: a false alarm" for change in alarms]
    if len(other) > MOST_DIFFERENT or are < were - MOST_LOST:
        words += [
            f"{change}; {len(other)} cases differ, {are} are right and {were} were"
            for change in other
        ]
    return words


def _essence(outcome: Outcome) -> tuple[bool, str | None]:
    return outcome.right, outcome.first


def _change(was: Outcome, now: Outcome) -> str:
    answers = [f"{o.first or o.status} ({'right' if o.right else 'wrong'})" for o in (was, now)]
    return f"{now.seed} {now.hidden}: {answers[0]} -> {answers[1]}"
