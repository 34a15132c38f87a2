"""Sensors that could be added, and which causes each of them separates, by their equations.

The difference of an added sensor to the drive's own one shows what acts between the two, and
nothing else, whatever the motion. So it also separates causes that no motion separates. Where a
cause acts follows from its equation: a reaction of the drive or behind it, a spring between motor
and link, a reading of an angle or of a torque.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from pipelines.contracts.joints import the
from pipelines.effects import Effect
from pipelines.effects.effect import Side
from pipelines.mechanics.machine import Machine


@dataclass(frozen=True)
class Sensor(ABC):
    """A sensor that could be added at one joint."""

    joint: str
    alone: ClassVar[bool]
    """Whether its difference is zero where nothing is missing."""

    @property
    @abstractmethod
    def words(self) -> str:
        """What to add, and where."""

    @abstractmethod
    def shows(self, effect: Effect) -> bool:
        """Return whether a cause acts between the drive's own sensor and this one."""

    def separates(self, one: Effect | None, other: Effect | None) -> bool:
        """Return whether it shows one of two causes, or of a cause and none, and not the other."""
        if one is None or other is None:
            cause = one or other
            return self.alone and cause is not None and self.shows(cause)
        return self.shows(one) != self.shows(other)


class TorqueSensor(Sensor):
    """It measures the torque that a drive passes on to its link."""

    alone = False  # friction of the drive is always between

    @property
    def words(self) -> str:
        """What to add, and where."""
        return f"add a torque sensor between drive and link of {the(self.joint)}"

    def shows(self, effect: Effect) -> bool:
        """Return whether a cause acts in the drive, or on its torque's reading."""
        in_drive = effect.reaction is not None and effect.side is Side.DRIVE
        return effect.joint == self.joint and (in_drive or effect.torque_reading is not None)


class LinkEncoder(Sensor):
    """It measures a link's own angle."""

    alone = True

    @property
    def words(self) -> str:
        """What to add, and where."""
        return f"add a second encoder on the link of {the(self.joint)}"

    def shows(self, effect: Effect) -> bool:
        """Return whether a cause acts between motor and link, or on the angle's reading."""
        between = effect.spring is not None and not effect.at_cuff
        of_encoder = effect.reading is not None and effect.side is Side.SENSOR
        return effect.joint == self.joint and (between or of_encoder)


def sensors_for(machine: Machine) -> list[Sensor]:
    """Return the sensors that could be added to a machine."""
    joints = machine.measured_names
    return [kind(joint) for kind in (TorqueSensor, LinkEncoder) for joint in joints]
