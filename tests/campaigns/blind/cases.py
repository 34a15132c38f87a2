"""Which cases an examination consists of: what is hidden in each, by its number alone."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from tests.campaigns.blind import further_forms  # noqa: F401 - adds to the causes
from tests.campaigns.blind.causes import FORMS, HUMAN_CAUSES, PLAIN_CAUSES, Spec, joints_of
from tests.campaigns.blind.conditions import ONE_KIND
from tests.campaigns.blind.faults import FAULTS
from tests.campaigns.blind.mechanisms import MECHANISMS, ONE_JOINT
from tests.campaigns.blind.outside import OF_ONE_JOINT, OUTSIDE
from tests.campaigns.blind.plan import HIP, KNEE

MIX = {
    "single": 0.55,
    "none": 0.10,
    "imperfect": 0.08,
    "pair": 0.12,
    "outside": 0.09,
    "fault": 0.06,
}
"""Shares of the categories in a mixed examination."""
MIX_OF_ONE_JOINT = {"single": 0.55, "none": 0.10, "imperfect": 0.10, "outside": 0.25}
"""The same of machines of one joint."""
CAUSES = tuple(FORMS)
"""All that can be hidden of the catalogue."""
SINGLES: tuple[Spec, ...] = tuple(
    (effect, joint) for effect in CAUSES for joint in joints_of(effect)
)
PLAIN_SINGLES: tuple[Spec, ...] = tuple(one for one in SINGLES if one[0] in PLAIN_CAUSES)
STAGGER = 17
"""Turns by which each further world is ahead, so that a few cases of each hide different things."""
NOT_TOGETHER = (
    {"backlash", "joint_elasticity"},  # one transmission a joint, and each hides the other
    {"cuff_compliance", "passive_joint_torque"},
    {"encoder_offset", "encoder_eccentricity"},
)


@dataclass(frozen=True)
class Case:
    """One session to be simulated."""

    seed: int
    category: str
    hidden: tuple[Spec, ...] = ()
    """Effects and their joints (0 hip, 1 knee, none for the whole leg)."""
    fault: str | None = None
    kinds: tuple[str, ...] = ("exo_alone", "with_human")
    machine: str = "leg"
    world: str = "mujoco"
    plain: bool = False
    """As in the first examinations: one rate, one kind of motion, a faultless rig. Only in world
    ``mujoco``."""

    def __post_init__(self) -> None:
        """Refuse what no simulator has."""
        if self.plain and self.world != "mujoco":
            raise ValueError(f"plain cases are of world mujoco, not of {self.world}")
        if self.machine != "leg" and not self.plain:
            raise ValueError(f"a {self.machine} is simulated in plain cases only: set plain")

    @property
    def label(self) -> str:
        """What is hidden, for reports."""
        joints = MECHANISMS[self.machine].joints
        names = [e if j is None else f"{e}@{joints[j]}" for e, j in self.hidden]
        return " + ".join(names) or self.fault or self.category

    def as_dict(self) -> dict:
        """Return what a truth file says of the case."""
        return asdict(self)


def mixed(
    cases: int, seed_base: int, mix: dict[str, float] = MIX, worlds: Sequence[str] = ("mujoco",)
) -> list[Case]:
    """Return cases of all categories, as many of each world; each goes through its causes in
    turn."""
    each = [cases // len(worlds) + (w < cases % len(worlds)) for w in range(len(worlds))]
    planned = [
        (category, i + w * STAGGER, world)
        for w, (world, count) in enumerate(zip(worlds, each, strict=True))
        for category, part in _counts(count, mix).items()
        for i in range(part)
    ]
    return [case(seed_base + k, *one) for k, one in enumerate(planned)]


def _counts(cases: int, mix: dict[str, float]) -> dict[str, int]:
    total = sum(mix.values())
    counts = {category: int(np.floor(cases * share / total)) for category, share in mix.items()}
    counts[max(mix, key=mix.__getitem__)] += cases - sum(counts.values())
    return counts


def of_one_joint(
    cases: int, seed_base: int, mix: dict[str, float] = MIX_OF_ONE_JOINT
) -> list[Case]:
    """Return cases of machines of one joint, each category going through machines and causes in
    turn."""
    places = [
        (name, effect)
        for effect in CAUSES
        for name in ONE_JOINT
        if effect in ONE_JOINT[name].effects
    ]
    outside = [(name, f"outside:{kind}") for kind in OF_ONE_JOINT for name in ONE_JOINT]
    plain = [(name, "") for name in ONE_JOINT]
    hides = {"single": places, "outside": outside, "none": plain, "imperfect": plain}
    planned = []
    for category, count in _counts(cases, mix).items():
        choices = hides[category]
        # A step that shares no factor with their number takes every choice before any a second
        # time.
        step = next(s for s in range(7, 7 + len(choices)) if np.gcd(s, len(choices)) == 1)
        planned += [(category, *choices[i * step % len(choices)]) for i in range(count)]
    return [
        Case(
            seed_base + k,
            category,
            ((effect, HIP),) if effect else (),
            None,
            ("exo_alone",),
            machine,
            plain=True,
        )
        for k, (category, machine, effect) in enumerate(planned)
    ]


def full(
    seed_base: int, each: int = 30, none: int = 300, worlds: Sequence[str] = ("mujoco",)
) -> list[Case]:
    """Return ``none`` cases with nothing hidden and ``each`` of every cause and joint, in turn in
    each world."""
    silent = [case(seed_base + k, "none", k, worlds[k % len(worlds)]) for k in range(none)]
    singles = [
        # Every cause in every world, though their numbers may share a factor.
        case(seed_base + none + k, "single", k, worlds[(k + k // len(SINGLES)) % len(worlds)])
        for k in range(each * len(SINGLES))
    ]
    return silent + singles


def case(seed: int, category: str, turn: int, world: str = "mujoco", plain: bool = False) -> Case:
    """Return a case; ``turn`` counts through what the category can hide."""
    rng = np.random.default_rng([seed, 1])
    singles = PLAIN_SINGLES if plain else SINGLES
    if category == "single":
        hidden: tuple[Spec, ...] = (singles[turn % len(singles)],)
    elif category == "pair":
        hidden = _pair(rng, singles[turn * 7 % len(singles)], singles)
    elif category == "outside":
        kind = OUTSIDE[turn % len(OUTSIDE)]
        hidden = ((f"outside:{kind}", int(rng.choice([HIP, KNEE]))),)
    else:
        hidden = ()
    fault = FAULTS[turn % len(FAULTS)].__name__ if category == "fault" else None
    kinds = _plain_kinds(rng, category, hidden) if plain else _kinds(rng, hidden)
    return Case(seed, category, hidden, fault, kinds, world=world, plain=plain)


def _pair(rng: np.random.Generator, first: Spec, singles: Sequence[Spec]) -> tuple[Spec, ...]:
    while True:
        second = singles[int(rng.integers(len(singles)))]
        both = {first[0], second[0]}
        if len(both) == 2 and both not in NOT_TOGETHER:
            return first, second


def _kinds(rng: np.random.Generator, hidden: tuple[Spec, ...]) -> tuple[str, ...]:
    """Draw runs of both kinds, or of one kind that what is hidden permits."""
    if rng.random() >= ONE_KIND:
        return "exo_alone", "with_human"
    needs_human = any(effect in HUMAN_CAUSES for effect, _ in hidden)
    return ("with_human",) if needs_human or rng.random() < 0.5 else ("exo_alone",)


def _plain_kinds(
    rng: np.random.Generator, category: str, hidden: tuple[Spec, ...]
) -> tuple[str, ...]:
    """Most sessions have runs of both kinds; some singles and faultless ones have one."""
    both = ("exo_alone", "with_human")
    draw = rng.random()
    if category not in ("single", "none") or draw < 0.8:
        return both
    needs_human = any(effect in HUMAN_CAUSES for effect, _ in hidden)
    return ("with_human",) if needs_human or draw < 0.9 else ("exo_alone",)
