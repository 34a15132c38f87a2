"""The motion behind a spring: a load that swings on it.

A soft or loose transmission follows its load only below its own frequency. Above it, and after
every reversal, the load swings, and a twist of torque over stiffness has the wrong size and sign.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect
from pipelines.effects.kernel import address, swing_along
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.mechanics.motion import Motion
from pipelines.signals.low_pass import derivative, low_pass, shortest


def link_behind_motor(
    motion: Motion, body: NDArray, effect: Effect, values: NDArray, ratio: float
) -> Motion:
    """Return the motion of the link behind an effect's transmission.

    The arguments are those of ``behind_spring``: ``body`` is (p,), ``values`` are (k,).
    """
    direction = np.zeros_like(motion.q)
    direction[:, effect.column(motion)] = 1.0
    rotor = rotor_among_links(motion, str(effect.joint))
    return behind_spring(motion, body, direction, effect, values, ratio, rotor)


def rotor_among_links(motion: Motion, joint: str) -> float:
    """Return the rotor's inertia that the rigid body's parameters include in the links, kg·m²."""
    # Middle of a rotor's typical range, kg·m².
    rotor_inertia = 0.17
    counted = motion.machine.is_exoskeleton and motion.machine.place(joint) in RotorInertia.absorbed
    return rotor_inertia if counted else 0.0


def behind_spring(
    motion: Motion,
    body: NDArray,
    direction: NDArray,
    effect: Effect,
    values: NDArray | tuple[float, ...],
    ratio: float = 0.0,
    with_motor: float = 0.0,
) -> Motion:
    """Return the motion behind an effect's spring.

    Parameters
    ----------
    motion : Motion
        Motion before the spring.
    body : (p,) array
        Inertial parameters of the load behind the spring.
    direction : (n, J) array
        Rotation of the joints per unit of twist.
    effect : Effect
        Effect with the ``spring``.
    values : (k,) array
        Values of the effect.
    ratio : float, optional
        Damping ratio in addition to the spring's own. Without damping, the simulated load would
        swing on indefinitely with every error of the load.
    with_motor : float, optional
        Inertia in the load that turns with the motor instead, kg·m².
    """
    # Least inertia of any load of an exoskeleton, kg·m².
    least_inertia = 0.02
    torque, inertia, *slopes = motion.load_columns.projected(direction) @ body
    # The rotor follows the motor, and its torque does not pass the spring.
    torque = torque - with_motor * np.sum(direction * motion.ddq, axis=1)
    along = [np.ascontiguousarray(part) for part in (torque, inertia - with_motor, *slopes)]
    least = least_inertia * effect.scale.of("kg·m²")
    spring = address(effect.spring), np.array(values, dtype=float)
    h, twist = 1.0 / motion.sample_rate_hz, np.zeros(len(motion))
    # Joints that no twist turns need no filter.
    joints = np.flatnonzero(direction.any(axis=0))
    moved = [state.copy() for state in (motion.q, motion.dq, motion.ddq)]
    for stretch in motion.segments():
        parts = (part[stretch] for part in along)
        swing_along(*spring, ratio, least, h, *parts, twist[stretch])
        # A stretch too short for the filter keeps the motion before the spring.
        if stretch.stop - stretch.start < shortest(motion.sample_rate_hz, motion.cutoff_hz):
            continue
        turned = twist[stretch, np.newaxis] * direction[stretch, :][:, joints]
        # The twist needs the filter of the measured motion, or the two would not be simultaneous.
        turned = low_pass(turned, motion.sample_rate_hz, motion.cutoff_hz)
        # A twist is the angle of the motor less that of the link.
        moved[0][stretch, joints] -= turned
        for order in (1, 2):
            moved[order][stretch, joints] -= derivative(turned, motion.sample_rate_hz, order)
    return motion.with_state(*moved)
