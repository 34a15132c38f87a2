"""Convert measurements at a motor to the joint: encoder, gear, screw, torque constant."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import pi, prod

from pipelines.contracts.joint_units import Kind, unit_at
from pipelines.contracts.joints import QUANTITIES
from pipelines.settings.units import UNITS


def dimension_at(kind: Kind, quantity: str) -> str:
    """Return the dimension of a quantity at a kind of joint: an angle, or a length."""
    return UNITS[unit_at(kind, QUANTITIES[quantity])].dimension


@dataclass(frozen=True)
class Step:
    """One part of a drive train, which converts dimensions by a number from its data sheet."""

    source: str
    target: str
    key: str
    divides: bool = False
    per_turn: bool = False
    """Whether the number is per turn, where the dimension is in radians."""

    def factor(self, value: float) -> float:
        """Return the factor on a reading."""
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
    # An ideal screw transmits all work: force times travel is torque times angle.
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
    # Current and temperature are the motor's own, whatever gear follows it.
    "current": 0,
    "temperature": 0,
}
"""Power of the gear ratio by dimension at the joint: it divides motion, multiplies torque."""


def paths(source: str, target: str) -> list[tuple[Step, ...]]:
    """Return all sequences of steps from one dimension to another, the shortest first."""
    if source == target:
        return [()]
    # The dimensions of `STEPS` form no cycle, so the recursion ends.
    sequences = [
        (step, *rest)
        for step in STEPS
        if step.source == source
        for rest in paths(step.target, target)
    ]
    return sorted(sequences, key=len)


def sources(target: str) -> list[str]:
    """Return the dimensions that can be converted to one."""
    others = (step.source for step in STEPS if paths(step.source, target))
    return list(dict.fromkeys([target, *others]))


def gain(source: str, target: str, given: Mapping[str, float], gear_ratio: float) -> float:
    """Return the factor from an SI reading to the quantity at the joint.

    Parameters
    ----------
    source, target : str
        Dimension of the reading, and of the quantity at the joint.
    given : mapping of str to float
        Numbers of the drive train, by key.
    gear_ratio : float
        Turns of the motor for one of the joint.

    Raises
    ------
    ValueError
        If a number is missing, or is not needed.
    """
    ways = paths(source, target)
    # All given numbers must be used: one that is not needed shows a wrong unit, or a wrong reading.
    complete = [way for way in ways if {step.key for step in way} == set(given)]
    if not complete:
        raise ValueError(_problem(ways, target, set(given)))
    # If several ways need these numbers, the shortest counts.
    return gear_ratio ** GEARED[target] * prod(step.factor(given[step.key]) for step in complete[0])


def _problem(ways: list[tuple[Step, ...]], target: str, given: set[str]) -> str:
    wanted = [{step.key for step in way} for way in ways]
    # Units of a prismatic joint's log, suggested where its map has the unit of a turning one.
    metric = {
        "length": ("m", "metres"),
        "velocity": ("m/s", "metres a second"),
        "force": ("N", "newtons"),
    }
    for keys in wanted:
        if not keys >= given:
            continue
        message = f"needs {_both(keys - given)}"
        if given - wanted[0]:
            message += f", or {_both(wanted[0] - given)} in place of {_both(given)}"
        message += "; add it from the data sheet"
        if keys == {"lead_m"}:
            unit, words = metric[target]
            message += f', or unit = "{unit}", if the log is in {words}'
        return message
    # No way uses all numbers: name those that are too many for the way that uses most of them.
    spare = min((given - keys for keys in wanted), key=len)
    return f"does not need {_both(spare)}; remove it, or correct the unit"


def _both(keys: Collection[str]) -> str:
    return " and ".join(sorted(keys))
