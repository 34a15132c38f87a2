"""Bodies with the identified dynamics: masses are chosen, identified parameters are kept.

Torques at the joints of a leg determine X1 to X4 (and moments across the segments), not the mass,
centre and inertia of each segment: a mass moved from the shank to the thigh's lower end changes no
torque. Simulators need all of these. With m the masses, c the centres along and a across the
segments, I the inertias about the centres,

    X2 = m2 (c2² + a2²) + I2,  X3 = m2 c2,  X4 = m1 c1 + m2 L1,
    X1 = m1 (c1² + a1²) + I1 + m2 L1² + X2

is a leg with I2 > 0 and I1 > 0 if and only if (X3² + Y3²) / X2 < m2 < (X1 - X2) / L1² and m1 is
large enough; such an m2 exists if and only if the mass matrix is positive definite. Here m2 is the
middle of that range, and m1 twice its minimum, but at least m2: a nominal leg, whose X are the
identified ones up to rounding.

A single joint's body has inertia X1 about the axis; a pendulum's mass is twice its minimum, or 1 kg
if that is more. A slide has mass X1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.effects import Element
from pipelines.errors import InputError
from pipelines.export.exported import ExportedModel
from pipelines.mechanics.mechanism import Mechanism
from pipelines.mechanics.mechanisms.leg import LEG, LEVEL_LEG
from pipelines.mechanics.mechanisms.single import LIFT, PENDULUM, SLIDE, TURNTABLE

Vector = tuple[float, float, float]


NOMINAL = "Masses are nominal where X does not determine them; joint torques are unchanged."


@dataclass(frozen=True)
class Body:
    """A rigid body behind its joint. SI units, in the joint's frame."""

    joint: Joint
    mass: float
    inertia: float
    """About every axis through the centre of mass, kg·m².

    Only the axis normal to the plane of motion matters; three equal values satisfy the triangle
    inequality that simulators check.
    """
    across: float = 0.0
    """Position of the centre of mass across the body, in the direction of positive angles, m."""
    along: float = 0.0
    """Position of the centre of mass along the body, m."""
    axis: Vector = (0.0, -1.0, 0.0)
    """x is forward, z up: about the default a positive angle swings a hanging body forward."""
    lies: Vector = (0.0, 0.0, -1.0)
    """Direction from the joint along the body, at angle zero; the default hangs."""
    beyond: float = 0.0
    """Distance from the previous joint along the previous body, m."""
    shift: float = 0.0
    """Encoder's angle less the joint's own."""
    carried: float = 0.0
    """Share of its weight that a counterweight balances."""

    @property
    def centre(self) -> NDArray:
        """Centre of mass, (3,) m."""
        # Adding zero turns -0 into 0.
        return self.across * np.cross(self.axis, self.lies) + self.along * np.array(self.lies) + 0.0

    @property
    def place(self) -> NDArray:
        """Position of its joint in the previous joint's frame, (3,) m."""
        return self.beyond * np.array(self.lies) + 0.0


def bodies(exported: ExportedModel) -> tuple[Body, ...]:
    """Return the machine's bodies, from the base on.

    Raises
    ------
    InputError
        If no bodies have such X, because only rotor inertia makes the mass matrix positive
        definite; or if the mechanism has no rule for its bodies.
    """
    bodies_of: dict[Mechanism, Callable[[ExportedModel], tuple[Body, ...]]] = {
        LEG: _leg,
        LEVEL_LEG: _level_leg,
        PENDULUM: _pendulum,
        TURNTABLE: _turntable,
        LIFT: _lift,
        SLIDE: _slide,
    }
    mechanism = exported.machine.mechanism
    if mechanism not in bodies_of:
        raise InputError(
            f"{mechanism.name} ({mechanism.joints_in_words}) has no rule for its bodies' masses."
            " Export to c, matlab or json, which need no bodies"
        )
    return bodies_of[mechanism](exported)


def _level_leg(exported: ExportedModel) -> tuple[Body, ...]:
    return tuple(
        replace(body, axis=(0.0, 0.0, 1.0), lies=(1.0, 0.0, 0.0)) for body in _leg(exported)
    )


def _leg(exported: ExportedModel) -> tuple[Body, ...]:
    """Return two links; without X4 (no gravity) the first link's centre is on its axis."""
    X1, X2, X3, *X4 = exported.X
    hip, knee = exported.joints
    across = [_moment_across(exported, joint) for joint in (hip, knee)]
    length, shift = exported.geometry.thigh_length_m, exported.shift()
    # First moments of mass, along and across; only their magnitude bounds the masses.
    of_shank = np.hypot(X3, across[1])
    if X2 <= 0 or X2 * (X1 - X2) <= (length * of_shank) ** 2:
        raise InputError(
            f"no two bodies have the rigid body of {exported.run}: X2 = {X2:.4g} kg·m², X2 (X1 -"
            f" X2) = {X2 * (X1 - X2):.4g}, expected above (L1 X3)² = {(length * of_shank) ** 2:.4g}"
            " kg²·m⁴. Identify again from motions that separate X1, X2 and X3 better, or export to"
            " c, matlab or json, which need no bodies"
        )
    m2 = 0.5 * (of_shank**2 / X2 + (X1 - X2) / length**2)
    # What the equations above leave for m1 (c1² + a1²) + I1 of the thigh.
    inertia = X1 - X2 - m2 * length**2
    along = X4[0] - m2 * length if X4 else 0.0
    of_thigh = np.hypot(along, across[0])
    # At its minimum the thigh would be a point mass, without inertia about its own centre.
    m1 = max(2.0 * of_thigh**2 / inertia, m2)
    thigh = Body(hip, m1, inertia - of_thigh**2 / m1, across[0] / m1, along / m1, shift=shift[0])
    shank = Body(
        knee, m2, X2 - of_shank**2 / m2, across[1] / m2, X3 / m2, beyond=length, shift=shift[1]
    )
    return thigh, shank


def _pendulum(exported: ExportedModel) -> tuple[Body, ...]:
    (joint,), (X1, X2), (shift,) = exported.joints, exported.X, exported.shift()
    across = _moment_across(exported, joint)
    moment = np.hypot(X2, across)
    # At its minimum the body would be a point mass; light ones get 1 kg.
    mass = max(2.0 * moment**2 / X1, 1.0)
    return (Body(joint, mass, X1 - moment**2 / mass, across / mass, X2 / mass, shift=shift),)


def _turntable(exported: ExportedModel) -> tuple[Body, ...]:
    (joint,), (X1,), (shift,) = exported.joints, exported.X, exported.shift()
    # No torque depends on its mass.
    return (Body(joint, 1.0, X1, axis=(0.0, 0.0, 1.0), shift=shift),)


def _lift(exported: ExportedModel) -> tuple[Body, ...]:
    (joint,), (mass, weight), (shift,) = exported.joints, exported.X, exported.shift()
    # X2 is the weight less a counterweight's; a share without gravity takes the latter's place.
    carried = 1.0 - weight / (mass * exported.geometry.gravity_m_s2)
    up = (0.0, 0.0, 1.0)
    return (Body(joint, mass, _cube(mass), axis=up, shift=shift, carried=carried),)


def _slide(exported: ExportedModel) -> tuple[Body, ...]:
    (joint,), (mass,), (shift,) = exported.joints, exported.X, exported.shift()
    return (Body(joint, mass, _cube(mass), axis=(1.0, 0.0, 0.0), shift=shift),)


def _cube(mass: float) -> float:
    """Return the inertia of a cube of 0.1 m, which no motion of a slide depends on."""
    return mass * 0.1**2 / 6.0


def _moment_across(exported: ExportedModel, joint: Joint) -> float:
    term = exported.of(Element.MASS_ACROSS, joint.name)
    return float(term.values[0]) if term else 0.0
