"""The worlds in which sessions are simulated, which share as few habits as may be."""

from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from tests.campaigns.blind import machine, planar, plant, two_mass
from tests.campaigns.blind.people import random_person
from tests.campaigns.blind.recorded import Recorded, Rig

LIGHTEST_KG, HEAVIEST_KG = 45.0, 110.0


@dataclass(frozen=True)
class World:
    """One simulator: how it draws a machine for a thigh's length, and how it records a run."""

    name: str
    machine: Callable[[Generator, float], object]
    record: Callable[..., Recorded]

    def rig(self, rng: Generator) -> Rig:
        """Draw a person and an exoskeleton that fits."""
        person = random_person(rng, LIGHTEST_KG, HEAVIEST_KG)
        return Rig(self.machine(rng, person.thigh_length), person)


WORLDS = {
    world.name: world
    for world in (
        World("mujoco", machine.random_rich_machine, plant.record),
        World("planar", planar.random_machine, planar.record),
        World("two_mass", two_mass.random_machine, two_mass.record),
    )
}
