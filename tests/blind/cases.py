"""Which cases an examination consists of: what is hidden in each, by its number alone."""

from dataclasses import asdict, dataclass

import numpy as np

from tests.blind.causes import CAUSES, HUMAN_CAUSES, Spec, joints_of
from tests.blind.faults import FAULTS
from tests.blind.mechanisms import MECHANISMS, ONE_JOINT
from tests.blind.outside import OF_ONE_JOINT, OUTSIDE
from tests.blind.plan import HIP, KNEE

MIX = {"single": 0.55, "none": 0.10, "imperfect": 0.08, "pair": 0.12, "outside": 0.09, "fault": 0.06}
"""Shares of the categories in a mixed examination."""
MIX_OF_ONE_JOINT = {"single": 0.55, "none": 0.10, "imperfect": 0.10, "outside": 0.25}
"""The same of machines of one joint."""
SINGLES: tuple[Spec, ...] = tuple((effect, joint) for effect in CAUSES for joint in joints_of(effect))
NOT_TOGETHER = (
    {"backlash", "joint_elasticity"},  # one transmission a joint, and each hides the other
    {"cuff_compliance", "passive_joint_torque"},
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

    @property
    def label(self) -> str:
        """What is hidden, for reports."""
        joints = MECHANISMS[self.machine].joints
        names = [e if j is None else f"{e}@{joints[j]}" for e, j in self.hidden]
        return " + ".join(names) or self.fault or self.category

    def as_dict(self) -> dict:
        """Return what a truth file says of the case."""
        return asdict(self)


def mixed(cases: int, seed_base: int, mix: dict[str, float] = MIX) -> list[Case]:
    """Return cases of all categories; each goes through its causes in turn."""
    planned = [(category, i) for category, count in _counts(cases, mix).items() for i in range(count)]
    return [case(seed_base + k, category, i) for k, (category, i) in enumerate(planned)]


def _counts(cases: int, mix: dict[str, float]) -> dict[str, int]:
    total = sum(mix.values())
    counts = {category: int(np.floor(cases * share / total)) for category, share in mix.items()}
    counts[max(mix, key=mix.__getitem__)] += cases - sum(counts.values())
    return counts


def of_one_joint(cases: int, seed_base: int, mix: dict[str, float] = MIX_OF_ONE_JOINT) -> list[Case]:
    """Return cases of machines of one joint, each category going through machines and causes in turn."""
    places = [(name, effect) for effect in CAUSES for name in ONE_JOINT if effect in ONE_JOINT[name].effects]
    outside = [(name, f"outside:{kind.__name__}") for kind in OF_ONE_JOINT for name in ONE_JOINT]
    plain = [(name, "") for name in ONE_JOINT]
    hides = {"single": places, "outside": outside, "none": plain, "imperfect": plain}
    planned = []
    for category, count in _counts(cases, mix).items():
        choices = hides[category]
        # A step that shares no factor with their number takes every choice before any a second time.
        step = next(s for s in range(7, 7 + len(choices)) if np.gcd(s, len(choices)) == 1)
        planned += [(category, *choices[i * step % len(choices)]) for i in range(count)]
    return [
        Case(seed_base + k, category, ((effect, HIP),) if effect else (), None, ("exo_alone",), machine)
        for k, (category, machine, effect) in enumerate(planned)
    ]


def full(seed_base: int, each: int = 30, none: int = 300) -> list[Case]:
    """Return ``none`` cases with nothing hidden and ``each`` of every cause and joint."""
    silent = [case(seed_base + k, "none", k) for k in range(none)]
    singles = [case(seed_base + none + k, "single", k) for k in range(each * len(SINGLES))]
    return silent + singles


def case(seed: int, category: str, turn: int) -> Case:
    """Return a case; ``turn`` counts through what the category can hide."""
    rng = np.random.default_rng([seed, 1])
    if category == "single":
        hidden: tuple[Spec, ...] = (SINGLES[turn % len(SINGLES)],)
    elif category == "pair":
        hidden = _pair(rng, SINGLES[turn * 7 % len(SINGLES)])
    elif category == "outside":
        kind = OUTSIDE[turn % len(OUTSIDE)].__name__
        hidden = ((f"outside:{kind}", int(rng.choice([HIP, KNEE]))),)
    else:
        hidden = ()
    fault = FAULTS[turn % len(FAULTS)].__name__ if category == "fault" else None
    return Case(seed, category, hidden, fault, _kinds(rng, category, hidden))


def _pair(rng: np.random.Generator, first: Spec) -> tuple[Spec, ...]:
    while True:
        second = SINGLES[int(rng.integers(len(SINGLES)))]
        both = {first[0], second[0]}
        if len(both) == 2 and both not in NOT_TOGETHER:
            return first, second


def _kinds(rng: np.random.Generator, category: str, hidden: tuple[Spec, ...]) -> tuple[str, ...]:
    """Most sessions have runs of both kinds; some singles and faultless ones have one."""
    both = ("exo_alone", "with_human")
    draw = rng.random()
    if category not in ("single", "none") or draw < 0.8:
        return both
    needs_human = any(effect in HUMAN_CAUSES for effect, _ in hidden)
    return ("with_human",) if needs_human or draw < 0.9 else ("exo_alone",)
