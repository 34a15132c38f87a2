"""A machine: a mechanism whose joints have names, and what is usual at each of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import combinations
from pkgutil import iter_modules
from typing import Any

from pipelines.contracts.joints import HIP_AND_KNEE, Joint, in_words
from pipelines.errors import InputError
from pipelines.mechanics import mechanisms
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanism import Mechanism
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.units import Scale


def _collected() -> tuple[Mechanism, ...]:
    """Return every mechanism in the files of mechanisms/, in the order of their names, each once.

    Raises
    ------
    InputError
        Where a recording's joints and gravity could be those of two.
    """
    names = sorted(module.name for module in iter_modules(mechanisms.__path__))
    modules = [import_module(f"{mechanisms.__name__}.{name}") for name in names]
    mechanisms_of = dict.fromkeys(
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, Mechanism)
    )
    for one, other in combinations(mechanisms_of, 2):
        gravity = (one.has_gravity, other.has_gravity)
        if one.kinds == other.kinds and (None in gravity or gravity[0] == gravity[1]):
            raise InputError(
                f"two mechanisms have the joints {', '.join(one.kinds)}: {one.name}"
                f" ({one.joints_in_words}) and {other.name} ({other.joints_in_words}), and no"
                " recording could say of which it is; remove one of their files from"
                " pipelines/mechanics/mechanisms, or let has_gravity tell them apart"
            )
    return tuple(mechanisms_of)


MECHANISMS = _collected()
"""All that there are. Adding one is a file in mechanisms/ and nothing else."""


def mechanisms_of(joints: Iterable[Joint]) -> tuple[Mechanism, ...]:
    """Return the mechanisms that have such joints, with gravity and without."""
    kinds = tuple(joint.kind for joint in joints)
    return tuple(mechanism for mechanism in MECHANISMS if mechanism.kinds == kinds)


def known_in_words() -> str:
    """Return what mechanisms there are, by what their joints are."""
    return "; ".join(mechanism.joints_in_words for mechanism in MECHANISMS)


@dataclass(frozen=True)
class Machine:
    """A mechanism and its joints' names."""

    mechanism: Mechanism = LEG
    joints: tuple[Joint, ...] = HIP_AND_KNEE
    scales: tuple[Scale, ...] = ()
    """Of each joint; empty where they are an exoskeleton's, or nobody has asked."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of its joints."""
        return tuple(joint.name for joint in self.joints)

    def joint(self, name: str) -> Joint:
        """Return the joint of a name."""
        return self.joints[self.names.index(name)]

    def scale(self, name: str) -> Scale:
        """Return the scale of the joint of a name."""
        return self.scales[self.names.index(name)] if self.scales else Scale()

    def lasting(self, seconds: float) -> float:
        """Return how long this machine needs for what an exoskeleton does in so many seconds, no
        longer than that, s.

        A pendulum that swings up goes five times as fast: a second of it tells as much.
        """
        slowest = max((scale.travel / scale.speed for scale in self.scales), default=1.0)
        return seconds * min(1.0, slowest)

    def metadata(self, geometry: Geometry) -> dict[str, float]:
        """Return what a file says of the machine's geometry: no length where none is in its
        equations."""
        stated = geometry.metadata()
        return stated if self.mechanism.has_length else {"gravity_m_s2": stated["gravity_m_s2"]}

    def place(self, name: str) -> str:
        """Return what effects call the joint of a name: ``hip`` for a leg's first, whatever it is
        called."""
        return self.mechanism.places[self.names.index(name)]

    @property
    def is_exoskeleton(self) -> bool:
        """Whether it is the leg that ranges and thresholds were found on: its joints say so by
        their names."""
        return self.joints == HIP_AND_KNEE


THE_LEG = Machine()


def machine_of(
    joints: Sequence[Joint], geometry: Geometry, source: Any = "", scales: tuple[Scale, ...] = ()
) -> Machine:
    """Return the machine with these joints; ``source`` begins the message where there is none.

    Raises
    ------
    InputError
        Where no mechanism has such joints.
    """
    for mechanism in mechanisms_of(joints):
        if mechanism.has_gravity in (None, geometry.gravity_m_s2 != 0.0):
            return Machine(mechanism, tuple(joints), scales)
    raise InputError(
        f"{source or 'the machine'} has joints {in_words(joints)} and gravity"
        f" {geometry.gravity_m_s2:g} m/s², expected those of a mechanism that exoid knows:"
        f" {known_in_words()}; correct the metadata, record one joint alone, or add a mechanism"
        " (docs/mechanisms.md)"
    )
