"""A machine: a mechanism whose joints have names and scales."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from itertools import combinations
from pkgutil import iter_modules
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joint_units import Scale
from pipelines.contracts.joints import HIP_AND_KNEE, Joint, in_words, the
from pipelines.errors import InputError
from pipelines.mechanics import mechanisms
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanism import Mechanism
from pipelines.mechanics.mechanisms.leg import LEG


def _collected() -> tuple[Mechanism, ...]:
    """Return every mechanism in the files of mechanisms/, in order of their names, each once."""
    names = sorted(module.name for module in iter_modules(mechanisms.__path__))
    modules = [import_module(f"{mechanisms.__name__}.{name}") for name in names]
    values = [value for module in modules for value in vars(module).values()]
    # A file that imports another file's mechanism would list it twice.
    all_mechanisms = dict.fromkeys(value for value in values if isinstance(value, Mechanism))
    for one, other in combinations(all_mechanisms, 2):
        gravity = (one.has_gravity, other.has_gravity)
        if one.kinds == other.kinds and (None in gravity or gravity[0] == gravity[1]):
            raise InputError(
                f"two mechanisms have the joints {', '.join(one.kinds)}: {one.name}"
                f" ({one.joints_in_words}) and {other.name} ({other.joints_in_words}), so that no"
                " recording determines its mechanism. Remove one of their files from"
                " pipelines/mechanics/mechanisms, or give them a different has_gravity"
            )
    return tuple(all_mechanisms)


MECHANISMS = _collected()
"""All mechanisms. A new one needs a file in mechanisms/ and nothing else."""


def mechanisms_of(joints: Iterable[Joint]) -> tuple[Mechanism, ...]:
    """Return the mechanisms with such joints, with gravity and without."""
    kinds = tuple(joint.kind for joint in joints)
    return tuple(mechanism for mechanism in MECHANISMS if mechanism.kinds == kinds)


def known_in_words() -> str:
    """Return the joints of all mechanisms, in words."""
    return "; ".join(mechanism.joints_in_words for mechanism in MECHANISMS)


@dataclass(frozen=True)
class Machine:
    """A mechanism and the names of its joints."""

    mechanism: Mechanism = LEG
    joints: tuple[Joint, ...] = HIP_AND_KNEE
    scales: tuple[Scale, ...] = ()
    """Scale of each joint; empty for an exoskeleton, or if the scales were not computed."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its joints."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def measured(self) -> NDArray:
        """(J,) bool: joints whose torque is known. The motion of the others is a known input."""
        return np.array([joint.is_measured for joint in self.joints])

    @property
    def measured_indices(self) -> list[int]:
        """Indices of the joints whose torque is known."""
        return [j for j, joint in enumerate(self.joints) if joint.is_measured]

    @property
    def measured_names(self) -> tuple[str, ...]:
        """Names of the joints whose torque is known."""
        return tuple(joint.name for joint in self.joints if joint.is_measured)

    @property
    def unmeasured_in_words(self) -> str:
        """Words about the joints whose torque was not measured; empty if there are none."""
        names = [the(joint.name) for joint in self.joints if not joint.is_measured]
        if not names:
            return ""
        inputs = (
            "its motion is a known input" if len(names) == 1 else "their motions are known inputs"
        )
        return f"the torque of {' and '.join(names)} was not measured: {inputs} of the other joints"

    def refuse_unmeasured(self, source: Any, use: str) -> None:
        """Refuse a machine with a joint whose torque was not measured.

        Parameters
        ----------
        source : Path or str
            Start of the message.
        use : str
            What needs every torque, as the start of a sentence.

        Raises
        ------
        InputError
            Names the joints.
        """
        if self.unmeasured_in_words:
            raise InputError(
                f"{source}: {self.unmeasured_in_words}. {use} needs a machine whose joints all have"
                ' a measured torque or drive = "none"'
            )

    @property
    def joint_metadata(self) -> list[dict[str, Any]]:
        """Its joints for a file's metadata."""
        return [joint.metadata for joint in self.joints]

    def joint(self, name: str) -> Joint:
        """Return the joint of a name."""
        return self.joints[self.names.index(name)]

    def scale(self, name: str) -> Scale:
        """Return the scale of the joint of a name."""
        return self.scales[self.names.index(name)] if self.scales else Scale()

    def lasting(self, seconds: float) -> float:
        """Return the time in which this machine moves as much as an exoskeleton in ``seconds``.

        It is never longer. A pendulum that swings up moves five times as fast, so that one second
        of it holds as much information as five.

        Parameters
        ----------
        seconds : float
            For an exoskeleton, s.

        Returns
        -------
        float
            s.
        """
        # Travel over speed is a joint's time scale. The slowest joint needs the longest recording.
        slowest = max((scale.travel / scale.speed for scale in self.scales), default=1.0)
        return seconds * min(1.0, slowest)

    def metadata(self, geometry: Geometry) -> dict[str, float]:
        """Return the geometry for a file's metadata, without lengths that no equation uses."""
        stated = geometry.metadata()
        return stated if self.mechanism.has_length else {"gravity_m_s2": stated["gravity_m_s2"]}

    def place(self, name: str) -> str:
        """Return the place of a joint in the mechanism, such as ``hip`` for a leg's first joint."""
        return self.mechanism.places[self.names.index(name)]

    @property
    def absorbs(self) -> Mapping[str, str]:
        """Kinds of torque that the parameters absorb completely, as ``Mechanism.absorbs``."""
        # A single reading fixes the scale of all parameters, so its gain does not show.
        one_reading = sum(joint.has_sensor for joint in self.joints) == 1
        gain = {"gain": "all parameters together"} if one_reading else {}
        return {**self.mechanism.absorbs, **gain}

    @property
    def is_leg(self) -> bool:
        """Whether it has a leg's equations, with or without gravity."""
        return self.mechanism.name == LEG.name

    @property
    def is_exoskeleton(self) -> bool:
        """Whether it is the leg of the standard ranges and thresholds, by its joints' names."""
        # It is no other leg where a torque was not recorded.
        return (
            tuple(
                joint if joint.is_measured else replace(joint, drive="measured")
                for joint in self.joints
            )
            == HIP_AND_KNEE
        )


THE_LEG = Machine()


def machine_of(
    joints: Sequence[Joint], geometry: Geometry, source: Any = "", scales: tuple[Scale, ...] = ()
) -> Machine:
    """Return the machine with some joints.

    Parameters
    ----------
    joints : sequence of Joint
        Its joints.
    geometry : Geometry
        Decides whether gravity acts.
    source : str, optional
        Start of the message.
    scales : tuple of Scale, optional
        Scale of each joint.

    Raises
    ------
    InputError
        If no mechanism has such joints, or none of them a measured torque.
    """
    if not any(joint.has_sensor for joint in joints):
        raise InputError(
            f"{source or 'the machine'}: no joint of {in_words(joints)} has a measured torque,"
            " expected one at least, as it fixes the scale of inertia and friction"
        )
    for mechanism in mechanisms_of(joints):
        if mechanism.has_gravity in (None, geometry.gravity_m_s2 != 0.0):
            return Machine(mechanism, tuple(joints), scales)
    raise InputError(
        f"{source or 'the machine'} has joints {in_words(joints)} and gravity"
        f" {geometry.gravity_m_s2:g} m/s², expected those of a mechanism that exoid knows:"
        f" {known_in_words()}; correct the metadata, record one joint alone, or add a mechanism"
        " (docs/mechanisms.md)"
    )
