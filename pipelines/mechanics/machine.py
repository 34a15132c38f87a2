"""A machine: a mechanism whose joints have names, and what is usual at each of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipelines.contracts.joints import HIP_AND_KNEE, Joint
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.leg import LEG
from pipelines.mechanics.mechanism import Mechanism
from pipelines.mechanics.single import LIFT, PENDULUM, SLIDE, TURNTABLE
from pipelines.mechanics.units import Scale

MECHANISMS = (LEG, PENDULUM, TURNTABLE, LIFT, SLIDE)
"""All that there are, in plain sight. Adding one is a file and a line here."""


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
        """Return how long this machine needs for what an exoskeleton does in so many seconds, no longer than that, s.

        A pendulum that swings up goes five times as fast: a second of it tells as much.
        """
        slowest = max((scale.travel / scale.speed for scale in self.scales), default=1.0)
        return seconds * min(1.0, slowest)

    def told(self, geometry: Geometry) -> dict[str, float]:
        """Return what a file says of the machine's geometry: one joint is at no distance from a second."""
        said = geometry.metadata()
        return said if len(self.joints) > 1 else {"gravity_m_s2": said["gravity_m_s2"]}

    def place(self, name: str) -> str:
        """Return what effects call the joint of a name: ``hip`` for a leg's first, whatever it is called."""
        return self.mechanism.places[self.names.index(name)]

    @property
    def is_exoskeleton(self) -> bool:
        """Whether it is the leg that ranges and thresholds were found on: its joints say so by their names."""
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
    kinds = tuple(joint.kind for joint in joints)
    for mechanism in MECHANISMS:
        if mechanism.kinds == kinds and mechanism.has_gravity in (None, geometry.gravity_m_s2 != 0.0):
            return Machine(mechanism, tuple(joints), scales)
    found = ", ".join(f"{joint.name} ({joint.kind})" for joint in joints)
    raise InputError(
        f"{source or 'the machine'} has joints {found}, expected two revolute joints in series or a single "
        "one, revolute or prismatic: exoid knows no other mechanism; correct the metadata, or record one joint alone"
    )
