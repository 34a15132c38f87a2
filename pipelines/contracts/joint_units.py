"""Units at a joint: radians and newton metres become metres and newtons at a prismatic joint.

A quantity's unit also determines how it scales with the machine: at twice the torque, a spring is
twice as stiff.
"""

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
UNITS = {
    "N·m": Unit("N", 1, 0, 0),
    "N·m/°C": Unit("N/°C", 1, 0, 0),
    "N·m·s/(rad·°C)": Unit("N·s/(m·°C)", 1, 0, -1),
    "N·m/s": Unit("N/s", 1, 0, 0),
    "N·m·s/rad": Unit("N·s/m", 1, 0, -1),
    "N·m·s²/rad²": Unit("N·s²/m²", 1, 0, -2),
    "N·m/rad": Unit("N/m", 1, -1, 0),
    "N·m/rad²": Unit("N/m²", 1, -2, 0),
    # An inertia is torque per acceleration, and accelerations scale as speed² / travel.
    "kg·m²": Unit("kg", 1, 1, -2),
    # A first moment times gravity is a torque, and gravity is the same for every machine.
    "kg·m": Unit("kg", 1, 0, 0),
    "rad": Unit("m", 0, 1, 0),
    "rad/s": Unit("m/s", 0, 0, 1),
    "rad/s²": Unit("m/s²", 0, -1, 2),
    "1/rad²": Unit("1/m²", 0, -2, 0),
    "1/turn": Unit("rad/m", 0, -1, 0),
}
"""Units that depend on the kind of joint; s, Hz, 1 and °C do not."""


def refuse_unknown_unit(name: str, unit: str) -> None:
    """Refuse a parameter's unit that depends on the kind of joint in an unknown way.

    Raises
    ------
    ValueError
        Names the parameter, its unit and the known ones.
    """
    # Lengths, masses and forces are the same at all joints: only their products with angles differ.
    of_joint = [part for part in ("N·m", "rad", "turn") if part in unit]
    known = {*UNITS, *(unit.prismatic for unit in UNITS.values())}
    # A parameter at a prismatic joint has its unit there.
    if of_joint and unit not in known:
        raise ValueError(
            f"{name}: found the unit {unit}, expected one without {' and '.join(of_joint)}, or one"
            f" of {', '.join(UNITS)}; add it to UNITS in pipelines/contracts/joint_units.py"
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
        if unit not in UNITS:
            return 1.0
        power = UNITS[unit]
        return float(
            self.torque**power.torque * self.travel**power.travel * self.speed**power.speed
        )


def unit_at(kind: Kind, unit: str) -> str:
    """Return the unit at a kind of joint for a unit at a revolute joint."""
    return UNITS[unit].prismatic if kind == "prismatic" and unit in UNITS else unit
