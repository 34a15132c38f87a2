"""What no entry of the catalogue describes: for these the right answer is ``unknown_cause``.

Each kind says to which families of laws it belongs (any of them is a right answer where a family is
asked for), whether it repeats with the motion, and whether it is held back: never shown to what
learns from sessions, so that one sees how it does on what it has never met.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tests.campaigns.blind import dry, smooth
from tests.campaigns.blind import further_torques as further
from tests.campaigns.blind.causes import BOUNDS, Cause, Reach, either, hidden_torque
from tests.campaigns.blind.plan import Plan, Run
from tests.campaigns.blind.wandering import random_curve


class Unlisted(NamedTuple):
    """One kind of what nobody listed."""

    name: str
    draw: Callable
    families: tuple[str, ...]
    repeats: bool
    held_back: bool
    at_both_joints: bool


KINDS: dict[str, Unlisted] = {}


def unlisted(
    *families: str, repeats: bool = True, held_back: bool = False, at_both_joints: bool = False
) -> Callable:
    """Register a kind; the function's name is the kind's."""

    def register(draw: Callable) -> Callable:
        name = draw.__name__
        KINDS[name] = Unlisted(name, draw, families, repeats, held_back, at_both_joints)
        return draw

    return register


@unlisted("time", repeats=False)
def tone(rng, joint):
    """A fan or a pump: one frequency that knows nothing of the motion, in every run."""
    frequency = rng.uniform(1.5, 9.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.torque(smooth.TONE, joint, size, frequency, run.rng.uniform(0.0, 2 * np.pi))

    return dict(install=install, start=1.5, slow=True, shape=(frequency,))


@unlisted("angle", "reversal", "speed")
def friction_by_other_joint(rng, joint):
    """A cable or a bearing squeezed by the other joint's angle."""
    shape = rng.uniform(2.5, 5.0), rng.uniform(0.0, 2 * np.pi)
    return dict(install=hidden_torque(dry.OTHER_JOINT, joint, *shape), start=1.5, shape=shape)


@unlisted("speed", "load")
def voltage_sag(rng, joint):
    """The supply sags when both motors run: torque is lost with the product of the speeds."""
    return dict(install=hidden_torque(smooth.BOTH_SPEEDS, joint, sign=either(rng)), start=3.0)


@unlisted("time", repeats=False)
def cable_drag(rng, joint):
    """A cable bundle that keeps settling: a drag that wanders within seconds, new in each run."""
    smoothing = rng.uniform(0.5, 1.5)

    def install(plan: Plan, size: float, run: Run) -> None:
        curve = random_curve(run.rng, run.duration_s, smoothing)
        curve -= np.interp(np.arange(len(curve)), [0, len(curve) - 1], [0.0, curve[-1]])
        curve /= np.sqrt(np.mean(curve**2))
        plan.torque(smooth.TABLE, joint, size, table=curve)

    return dict(install=install, start=2.0, slow=True, shape=(smoothing,))


@unlisted("reversal", "time")
def ringing(rng, joint):
    """A cover that rings for a while after each reversal."""
    shape = rng.uniform(2.5, 7.0), rng.uniform(0.3, 0.8)
    install = hidden_torque(smooth.RINGING, joint, *shape, sign=either(rng))
    return dict(install=install, start=3.0, shape=shape)


@unlisted("angle", at_both_joints=True)
def band_across_both_joints(rng, joint, reach=BOUNDS):
    """An elastic band from the pelvis to the shank, slack in one part of the range."""
    arms = rng.uniform(0.6, 1.0), rng.uniform(-1.0, -0.6)
    middle = float(np.dot(arms, (reach[0] + reach[1]) / 2)) + rng.uniform(-0.2, 0.2)

    def install(plan: Plan, size: float, run: Run) -> None:
        for j in range(2):
            plan.torque(smooth.BIARTICULAR, j, size, *arms, arms[j], middle)

    return dict(install=install, start=5.0, shape=(*arms, middle))


@unlisted("time", repeats=False)
def kicks(rng, joint):
    """Something knocks against the leg at moments of its own."""

    def install(plan: Plan, size: float, run: Run) -> None:
        t = np.arange(0.0, run.duration_s, 0.02)
        knocks = np.zeros_like(t)
        for start in np.cumsum(run.rng.exponential(1.2, int(run.duration_s))):
            since = t - start
            knocks += np.where(
                since >= 0, run.rng.normal() * np.exp(-np.maximum(since, 0.0) / 0.25), 0.0
            )
        plan.torque(smooth.TABLE, joint, size / np.sqrt(np.mean(knocks**2)), table=knocks)

    return dict(install=install, start=2.0, slow=True)


@unlisted("speed")
def dead_zone_damper(rng, joint):
    """A damper that grips only above some speed."""
    threshold = rng.uniform(0.15, 0.6)
    install = hidden_torque(smooth.DEAD_ZONE, joint, threshold)
    return dict(install=install, start=3.0, shape=(threshold,), kin=("quadratic_drag",))


@unlisted("angle", held_back=True)
def detent(rng, joint, reach=BOUNDS):
    """A magnet that pulls the joint into one place."""
    low, high = reach[0][joint], reach[1][joint]
    place, width = low + rng.uniform(0.2, 0.8) * (high - low), rng.uniform(0.08, 0.2)
    install = hidden_torque(smooth.DETENT, joint, place, width)
    return dict(install=install, start=3.0, shape=(place, width))


@unlisted("load", "sensor")
def bent_gain(rng, joint):
    """A motor that saturates, or a sensor that bends: the gain depends on the torque's size."""
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.bend[joint] += sign * size

    return dict(install=install, start=0.005, largest=0.02, shape=(sign,), kin=("torque_gain",))


@unlisted("load", "reversal", "speed")
def friction_by_other_load(rng, joint):
    """A shared bearing: friction rises with what the other joint's gear transmits."""
    return dict(install=hidden_torque(dry.OTHER_LOAD, joint), start=0.1, largest=0.5)


@unlisted("angle")
def sliding_mass(rng, joint, reach=BOUNDS):
    """A loose part that slides along the segment as the joint swings."""
    low, high = reach[0][joint], reach[1][joint]
    span = high - low
    shape = low + rng.uniform(0.3, 0.7) * span, rng.uniform(0.1, 0.3) * span, rng.uniform(0.12, 0.3)
    install = hidden_torque(further.SLIDING_MASS, joint, *shape)
    return dict(install=install, start=1.0, largest=8.0, shape=shape)


@unlisted("angle", "speed", "time")
def creeping_spring(rng, joint, reach=BOUNDS):
    """Foam or a strap: a spring whose rest follows the joint within seconds."""
    low, high = reach[0][joint], reach[1][joint]
    shape = rng.uniform(low, high), rng.uniform(0.3, 2.5), rng.uniform(0.6, 1.0)
    install = hidden_torque(further.CREEP_SPRING, joint, *shape)
    return dict(install=install, start=5.0, shape=shape)


@unlisted("load", "sensor")
def torque_steps(rng, joint):
    """A torque reported in coarse steps, and none near zero."""
    dead = rng.uniform(0.0, 0.8)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.quantum[joint] = size
        plan.channel.dead_band[joint] = dead * size

    return dict(install=install, start=2.0, fast=True, shape=(dead,))


@unlisted("sensor", "time", held_back=True)
def held_torque(rng, joint):
    """A torque that the bus refreshes less often than rows are written."""

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.hold_s[joint] = size

    return dict(install=install, start=0.05, smallest=0.02, largest=0.2, kin=("time_delay",))


@unlisted("speed", "load", "sensor")
def torque_lost_with_speed(rng, joint):
    """Back-EMF eats the voltage: above some speed a motor delivers less than its current says."""
    threshold = rng.uniform(0.1, 0.5)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.of_speed[joint].append(
            lambda torque, v: torque * size * np.maximum(np.abs(v) - threshold, 0.0)
        )

    return dict(install=install, start=0.3, largest=1.5, shape=(threshold,))


@unlisted("speed", held_back=True)
def other_speed_squared(rng, joint):
    """Oil or air that the other joint drives against this one."""
    install = hidden_torque(further.OTHER_SPEED_SQUARED, joint, sign=either(rng))
    return dict(install=install, start=2.0)


@unlisted("time", "speed", repeats=False)
def wandering_viscosity(rng, joint):
    """Grease that comes and goes: viscous friction that wanders, other in each run."""
    smoothing = rng.uniform(1.5, 5.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        curve = random_curve(run.rng, run.duration_s, smoothing)
        curve = (curve - curve.min()) / np.std(curve)
        plan.torque(further.VISCOUS_TABLE, joint, size, table=curve)

    return dict(install=install, start=2.0, slow=True, shape=(smoothing,))


OUTSIDE = tuple(KINDS)
"""Names of all kinds; the first four are those of the fixed set, in its order."""
OF_ONE_JOINT = (
    "tone",
    "cable_drag",
    "ringing",
    "kicks",
    "dead_zone_damper",
    "detent",
    "bent_gain",
    "creeping_spring",
    "torque_steps",
    "held_torque",
    "wandering_viscosity",
)
"""What a machine of one joint can have of it."""


def random_outside(rng, name: str, joint: int, reach: Reach = BOUNDS) -> Cause:
    """Draw the shape of something that is not in the catalogue."""
    kind = KINDS[name]
    within = kind.draw.__code__.co_argcount > 2
    drawn = kind.draw(rng, joint, reach) if within else kind.draw(rng, joint)
    return Cause(
        effect=f"outside:{name}",
        joint=joint,
        form=name,
        own=False,
        families=kind.families,
        repeats=kind.repeats,
        held_back=kind.held_back,
        at_both_joints=kind.at_both_joints,
        **drawn,
    )
