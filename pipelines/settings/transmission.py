"""From what was measured at a motor to what it is at the joint: encoder, gear, screw, torque
constant."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import pi, prod

from pipelines.contracts.joints import Kind

TARGETS: dict[str, dict[Kind, str]] = {
    "angle": {"revolute": "angle", "prismatic": "length"},
    "reference": {"revolute": "angle", "prismatic": "length"},
    "velocity": {"revolute": "angular velocity", "prismatic": "velocity"},
    "torque": {"revolute": "torque", "prismatic": "force"},
    "current": {"revolute": "current", "prismatic": "current"},
    "temperature": {"revolute": "temperature", "prismatic": "temperature"},
}
"""What a joint's quantity is, for each kind of joint."""


@dataclass(frozen=True)
class Step:
    """One part of a drive train: it makes one dimension of another, by a number that stands on its
    data sheet."""

    source: str
    target: str
    key: str
    divides: bool = False
    per_turn: bool = False
    """Does the number count per turn, where the dimension counts radians?"""

    def factor(self, value: float) -> float:
        """Return what a reading is multiplied by."""
        value = value / (2.0 * pi) if self.per_turn else value
        return 1.0 / value if self.divides else value


STEPS = (
    Step("counts", "angle", "counts_per_turn", divides=True, per_turn=True),
    Step("counts per second", "angular velocity", "counts_per_turn", divides=True, per_turn=True),
    Step("counts", "length", "counts_per_m", divides=True),
    Step("counts per second", "velocity", "counts_per_m", divides=True),
    Step("current", "torque", "torque_constant_nm_a"),
    Step("current", "force", "force_constant_n_a"),
    Step("voltage", "torque", "gain_nm_v"),
    Step("voltage", "force", "gain_n_v"),
    Step("share", "torque", "rated_torque_nm"),
    Step("share", "force", "rated_force_n"),
    Step("angle", "length", "lead_m", per_turn=True),
    Step("angular velocity", "velocity", "lead_m", per_turn=True),
    Step("torque", "force", "lead_m", divides=True, per_turn=True),
)
KEYS = tuple(dict.fromkeys(step.key for step in STEPS))
GEARED = {
    "angle": -1,
    "length": -1,
    "angular velocity": -1,
    "velocity": -1,
    "torque": 1,
    "force": 1,
    "current": 0,
    "temperature": 0,
}
"""Power of the gear ratio, by what arrives at the joint: motion is divided by it, torque is
multiplied."""

METRIC = {
    "length": ("m", "metres"),
    "velocity": ("m/s", "metres a second"),
    "force": ("N", "newtons"),
}
"""What a log of a joint that slides may be in, where its map says what turns."""


def paths(source: str, target: str) -> list[tuple[Step, ...]]:
    """Return all ways through a drive train from one dimension to another, the shortest first."""
    if source == target:
        return [()]
    found = [
        (step, *rest)
        for step in STEPS
        if step.source == source
        for rest in paths(step.target, target)
    ]
    return sorted(found, key=len)


def sources(target: str) -> list[str]:
    """Return the dimensions from which there is a way to one."""
    return list(
        dict.fromkeys([target, *(step.source for step in STEPS if paths(step.source, target))])
    )


def gain(source: str, target: str, given: Mapping[str, float], gear_ratio: float) -> float:
    """Return what an SI reading is multiplied by to be what it is at the joint.

    Raises
    ------
    ValueError
        Where a number on the way is not given, or one is given that no way needs.
    """
    ways = paths(source, target)
    complete = [way for way in ways if {step.key for step in way} == set(given)]
    if not complete:
        raise ValueError(_what_is_wrong(ways, target, set(given)))
    return gear_ratio ** GEARED[target] * prod(step.factor(given[step.key]) for step in complete[0])


def _what_is_wrong(ways: list[tuple[Step, ...]], target: str, given: set[str]) -> str:
    wanted = [{step.key for step in way} for way in ways]
    for keys in wanted:
        if keys >= given:
            instead = (
                f", or {_both(wanted[0] - given)} in place of {_both(given)}"
                if given - wanted[0]
                else ""
            )
            metric = METRIC[target] if keys == {"lead_m"} else None
            rather = f', or unit = "{metric[0]}", where the log is in {metric[1]}' if metric else ""
            return f"needs {_both(keys - given)}{instead}; add it from the data sheet{rather}"
    spare = min((given - keys for keys in wanted), key=len)
    return f"has no use for {_both(spare)}; remove it, or correct the unit"


def _both(keys: Collection[str]) -> str:
    return " and ".join(sorted(keys))
