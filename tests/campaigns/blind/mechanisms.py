"""What is moved and recorded: the exoskeleton's leg with its wearer, or a machine of one joint.

A machine of one joint is the simulated leg whose knee stands still and whose shank weighs nothing;
what it records is the hip's, under another name and in the units of a machine of another size.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind import imperfections
from tests.campaigns.blind.body import Leg, Segment
from tests.campaigns.blind.causes import Spec, log_uniform
from tests.campaigns.blind.excitation import Excitation, random_excitation
from tests.campaigns.blind.machine import random_machine
from tests.campaigns.blind.people import random_person
from tests.campaigns.blind.plan import HIP, JOINTS, Run
from tests.campaigns.blind.recorded import Recorded, Rig
from tests.campaigns.blind.units import Units

WEIGHTLESS = Segment(1e-4, 0.0, 1e-5)
LENGTH = 0.4
QUIET = 0.4
"""Of a leg's noise: a single link needs less torque."""


class Mechanism(Protocol):
    """What the rest of the examination asks of it."""

    joints: tuple[str, ...]
    small: tuple[Spec, ...]
    """What may be a little off on a good one."""

    def rig(self, rng: Generator) -> Rig:
        """Draw one, and who wears it."""

    def excitation(self, rng: Generator) -> Excitation:
        """Draw a motion."""

    def columns(self, rig: Rig, r: Recorded) -> dict[str, np.ndarray]:
        """Return a run as its recording has it."""

    def header(self, rig: Rig, r: Recorded) -> dict[str, Any]:
        """Return what the recording says of the machine."""

    def truth(self, rig: Rig, kinds: Sequence[str]) -> dict[str, Any]:
        """Return what a truth file says of the rig in these kinds of run, in the recording's
        units."""


@dataclass(frozen=True)
class ExoskeletonLeg:
    """Hip and knee."""

    joints: ClassVar = JOINTS
    small: ClassVar = imperfections.SMALL

    def rig(self, rng: Generator) -> Rig:
        """Draw a person and an exoskeleton that fits."""
        person = random_person(rng)
        return Rig(random_machine(rng, person.thigh_length), person)

    def excitation(self, rng: Generator) -> Excitation:
        """Draw a motion of both joints."""
        return random_excitation(rng)

    def columns(self, rig: Rig, r: Recorded) -> dict[str, np.ndarray]:
        """Return time, both joints, cuff forces and counter."""
        columns = {"time_s": r.time.copy()}
        for quantity in _REVOLUTE(r):
            for j, joint in enumerate(JOINTS):
                columns[f"{joint}_{quantity.column}"] = quantity.values[:, j].copy()
        if r.forces is not None:
            for s, sensor in enumerate(("thigh_front", "thigh_back", "shank_front", "shank_back")):
                for i, axis in enumerate("xyz"):
                    columns[f"{sensor}_force_{axis}_n"] = r.forces[:, s, i].copy()
        return columns | _counted(r)

    def header(self, rig: Rig, r: Recorded) -> dict[str, Any]:
        """Return controller and geometry."""
        machine = rig.machine
        geometry = {"thigh_length_m": machine.leg.length, "gravity_m_s2": machine.leg.gravity}
        if r.run.has_human:
            thigh, shank = machine.cuff_distance
            geometry |= {"thigh_cuff_distance_m": thigh, "shank_cuff_distance_m": shank}
        controller = {joint: machine.controller(j) for j, joint in enumerate(JOINTS)}
        return {"controller": controller, "geometry": geometry}

    def truth(self, rig: Rig, kinds: Sequence[str]) -> dict[str, Any]:
        """Return the wearer, the rigid body and the machine."""
        return {
            "person": asdict(rig.person),
            "X": {
                kind: rig.leg(Run(kind, "train", 0.0, None)).inertial().tolist() for kind in kinds
            },
            "machine": {
                name: np.asarray(getattr(rig.machine, name)).tolist()
                for name in ("coulomb", "viscous", "hip_rotor", "counts", "ripple", "ripple_time")
            },
        }


@dataclass(frozen=True)
class OneJoint:
    """One driven joint and nobody in it."""

    kind: str
    gravity: float
    """What turns a revolute joint back, m/s²; 0 where its axis stands upright or it slides."""
    weight: bool = False
    """Whether a slide carries its weight."""
    joints: ClassVar = ("axis",)

    @property
    def small(self) -> tuple[Spec, ...]:
        """What is small at a leg's hip and can be at this machine."""
        return tuple(one for one in imperfections.SMALL if one[1] == HIP and one[0] in self.effects)

    @property
    def effects(self) -> tuple[str, ...]:
        """Causes of the contract that such a machine can have, and that are no part of its rigid
        body."""
        turned = (
            "backlash",
            "mass_off_axis",
            "payload_change",
            "encoder_offset",
            "encoder_eccentricity",
        )
        constant = ("coulomb_asymmetry", "torque_offset")
        return (*ANYWHERE, *(turned if self.gravity else ()), *(() if self.weight else constant))

    def rig(self, rng: Generator) -> Rig:
        """Draw a link, a drive, and how large the whole is."""
        mass, along = rng.uniform(2.5, 8.0), rng.uniform(0.15, 0.45)
        link = Segment(mass, along, mass * rng.uniform(0.01, 0.03))
        drawn = random_machine(rng, LENGTH)
        leg = Leg(link, WEIGHTLESS, LENGTH, self.gravity)
        machine = replace(drawn, leg=leg, ripple=QUIET * drawn.ripple)
        size = Units(log_uniform(rng, 0.01, 5.0))
        if self.kind == "prismatic":
            size = Units(log_uniform(rng, 1.0, 100.0), log_uniform(rng, 0.02, 0.5))
        return Rig(
            machine, random_person(rng), size, rng.uniform(5.0, 25.0) if self.weight else 0.0
        )

    def excitation(self, rng: Generator) -> Excitation:
        """Draw a motion, on either side of where stops and detents are; what would be the knee
        stands still."""
        drawn = random_excitation(rng)
        still = np.zeros_like(drawn.a)
        still[HIP] = 1.0
        middle = np.array([rng.uniform(0.2, 0.8), drawn.theta0[1]])
        return Excitation(middle, drawn.a * still, drawn.b * still)

    def columns(self, rig: Rig, r: Recorded) -> dict[str, np.ndarray]:
        """Return time, the joint and counter."""
        columns = {"time_s": r.time.copy()}
        for quantity in _PRISMATIC(r) if self.kind == "prismatic" else _REVOLUTE(r):
            factor = rig.units.factor(quantity.torque, quantity.angle)
            columns[f"axis_{quantity.column}"] = factor * quantity.values[:, HIP]
        return columns | _counted(r)

    def header(self, rig: Rig, r: Recorded) -> dict[str, Any]:
        """Return joint and gravity."""
        gravity = 9.81 if self.weight else self.gravity
        return {
            "joints": [{"name": "axis", "kind": self.kind}],
            "geometry": {"gravity_m_s2": gravity},
        }

    def truth(self, rig: Rig, kinds: Sequence[str]) -> dict[str, Any]:
        """Return the rigid body, its motor's rotor with it, and the machine; nobody wears it."""
        machine, units = rig.machine, rig.units
        inertia, _, _, moment = machine.leg.inertial()
        X = [units.factor(1, -1) * (inertia + machine.hip_rotor)]
        X += [units.factor(1, 0) * float(moment)] if self.gravity else []
        X += [units.factor(1, 0) * rig.weight] if self.weight else []
        return {
            "person": None,
            "units": asdict(units),
            "X": dict.fromkeys(kinds, X),
            "machine": {
                "coulomb": [units.factor(1, 0) * float(machine.coulomb[HIP])],
                "viscous": [units.factor(1, -1) * float(machine.viscous[HIP])],
                "resolution": [units.factor(0, 1) * 2 * np.pi / float(machine.counts[HIP])],
                "ripple": [units.factor(1, 0) * float(machine.ripple[HIP])],
                "ripple_time": [float(machine.ripple_time[HIP])],
            },
        }


ANYWHERE = (
    "stribeck_friction",
    "viscous_asymmetry",
    "load_dependent_friction",
    "quadratic_drag",
    "presliding_hysteresis",
    "friction_warmup",
    "cogging",
    "joint_elasticity",
    "parallel_spring",
    "torque_drift",
    "time_delay",
    "end_stop",
    "position_dependent_friction",
    "gain_drift",
)
"""Causes that a joint can have wherever it stands."""
ONE_JOINT: dict[str, OneJoint] = {
    "pendulum": OneJoint("revolute", 9.81),
    "turntable": OneJoint("revolute", 0.0),
    "slide": OneJoint("prismatic", 0.0),
    "lift": OneJoint("prismatic", 0.0, weight=True),
}
MECHANISMS: dict[str, Mechanism] = {"leg": ExoskeletonLeg(), **ONE_JOINT}


class _Quantity(NamedTuple):
    """What is recorded of each joint: the end of its column's name, values (n, 2), powers of torque
    and of angle."""

    column: str
    values: NDArray
    torque: int
    angle: int


def _named(
    angle: str, torque: str, reference: str, speed: str
) -> Callable[[Recorded], list[_Quantity]]:
    def of(r: Recorded) -> list[_Quantity]:
        return [
            _Quantity(angle, r.angle, 0, 1),
            _Quantity(torque, r.torque, 1, 0),
            _Quantity(reference, r.reference, 0, 1),
            _Quantity(speed, r.drive_speed, 0, 1),
        ]

    return of


_REVOLUTE = _named("angle_rad", "torque_nm", "reference_rad", "velocity_rad_s")
_PRISMATIC = _named("position_m", "force_n", "reference_m", "velocity_m_s")


def _counted(r: Recorded) -> dict[str, np.ndarray]:
    return {"sequence": np.arange(len(r.time), dtype=np.int64)}
