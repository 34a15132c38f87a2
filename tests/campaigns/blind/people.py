"""Random people: their legs by body mass and height.

Winter (2009), Biomechanics and Motor Control of Human Movement, table 4.1: segment masses, centres
of mass and radii of gyration as shares; thigh 0.245 and shank 0.246 of the height (figure 4.1).
"""

from dataclasses import dataclass

from numpy.random import Generator

from tests.campaigns.blind.body import Leg, Segment


@dataclass(frozen=True)
class Person:
    """One wearer."""

    mass_kg: float
    height_m: float

    @property
    def thigh_length(self) -> float:
        """Hip to knee, m."""
        return 0.245 * self.height_m

    @property
    def leg(self) -> Leg:
        """Thigh, and shank with foot."""
        shank = 0.246 * self.height_m
        return Leg(
            _segment(0.100 * self.mass_kg, self.thigh_length, 0.433, 0.323),
            _segment(0.061 * self.mass_kg, shank, 0.606, 0.416),
            self.thigh_length,
        )


def random_person(rng: Generator, lightest_kg: float = 50.0, heaviest_kg: float = 100.0) -> Person:
    """Draw a person whose height suits the mass (body mass index 19 to 30)."""
    mass = rng.uniform(lightest_kg, heaviest_kg)
    height = (mass / rng.uniform(19.0, 30.0)) ** 0.5
    return Person(mass, min(1.98, max(1.50, height)))


def _segment(mass: float, length: float, centre: float, gyration: float) -> Segment:
    return Segment(mass, centre * length, mass * (gyration * length) ** 2)
