"""Units at a joint: radians and newton metres become metres and newtons at a prismatic joint.

A quantity's unit also determines how it scales with the machine: at twice the torque, a spring is
twice as stiff.
"""

import re
from functools import cache
from typing import Literal, NamedTuple

Kind = Literal["revolute", "prismatic"]
Drive = Literal["measured", "none", "unmeasured"]


class Unit(NamedTuple):
    """A unit of a parameter, as written for revolute joints."""

    prismatic: str
    """The same unit at a prismatic joint."""
    torque: int
    travel: int
    speed: int
    """Exponents of the joint's torque, travel and speed with which a quantity of this unit
    scales."""


FIRST_MOMENT = "kg·m"
"""Unit that identifies a rigid body's first moments of mass among its parameters."""
FACTORS = {
    "N·m": Unit("N", 1, 0, 0),
    # An inertia is torque per acceleration, and accelerations scale as speed² / travel.
    "kg·m²": Unit("kg", 1, 1, -2),
    # A first moment times gravity is a torque, and gravity is the same for every machine.
    FIRST_MOMENT: Unit("kg", 1, 0, 0),
    "rad": Unit("m", 0, 1, 0),
}
"""Factors of a unit that depend on the kind of joint."""
WHOLE = {
    "1/turn": Unit("rad/m", 0, -1, 0),
    # What becomes of 1/turn at a prismatic joint.
    "rad/m": Unit("rad/m", 0, 0, 0),
}
"""Units that are not converted factor by factor."""
_KNOWN = "|".join(sorted(FACTORS, key=len, reverse=True))
_FACTOR = re.compile(rf"({_KNOWN}|[^·()/²³]+)([²³]?)(?=[·()/]|$)")
"""A factor and its power."""
_POWERS = {"": 1, "²": 2, "³": 3}


@cache
def unit_of(text: str) -> Unit:
    """Return how a unit at a revolute joint depends on the kind of joint and its size.

    Parameters
    ----------
    text : str
        Products and one quotient of factors, such as ``N·m·s/(rad·°C)``.

    Returns
    -------
    Unit
        Of exponents zero for a unit that does not depend on the joint, such as °C or Hz.
    """
    if text in WHOLE:
        return WHOLE[text]
    above, _, below = text.partition("/")
    factors = [
        (symbol, sign * _POWERS[power])
        for part, sign in ((above, 1), (below, -1))
        for symbol, power in _FACTOR.findall(part)
    ]
    # Next to an angle or an inertia a second is the motion's, and scales as travel / speed.
    # Elsewhere, as in a drift of N·m/s, it is wall time.
    of_motion = any(symbol in ("rad", "kg·m²") for symbol, _ in factors)
    time = Unit("s", 0, 1, -1) if of_motion else Unit("s", 0, 0, 0)
    torque = travel = speed = 0
    for symbol, power in factors:
        unit = time if symbol == "s" else FACTORS.get(symbol, Unit(symbol, 0, 0, 0))
        torque += power * unit.torque
        travel += power * unit.travel
        speed += power * unit.speed
    prismatic = _FACTOR.sub(
        lambda match: (FACTORS[match[1]].prismatic if match[1] in FACTORS else match[1]) + match[2],
        text,
    )
    return Unit(prismatic, torque, travel, speed)


def refuse_unknown_unit(name: str, unit: str) -> None:
    """Refuse a parameter's unit that depends on the kind of joint in an unknown way.

    Raises
    ------
    ValueError
        Names the parameter, its unit and the factors of known ones.
    """
    if unit in WHOLE:
        return
    known = [symbol for symbol, _ in _FACTOR.findall(unit) if symbol in FACTORS]
    # Lengths, masses and forces are the same at all joints: only their products with angles differ.
    if any(unit.count(part) > known.count(part) for part in ("N·m", "rad", "turn")):
        raise ValueError(
            f"{name}: found the unit {unit}, expected products and one quotient of"
            f" {', '.join(FACTORS)}, s and others such as °C, with powers ² and ³, or 1/turn"
        )


class Scale(NamedTuple):
    """Ratios of a joint's torque, speed and travel to an exoskeleton's."""

    torque: float = 1.0
    speed: float = 1.0
    travel: float = 1.0

    def of(self, unit: str) -> float:
        """Return the ratio of a quantity to an exoskeleton's.

        Parameters
        ----------
        unit : str
            The quantity's unit at a revolute joint.

        Returns
        -------
        float
            1 for a unit that does not depend on the machine's size.
        """
        power = unit_of(unit)
        return float(
            self.torque**power.torque * self.travel**power.travel * self.speed**power.speed
        )


def unit_at(kind: Kind, unit: str) -> str:
    """Return the unit at a kind of joint for a unit at a revolute joint."""
    return unit_of(unit).prismatic if kind == "prismatic" else unit
