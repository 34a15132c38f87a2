"""What no entry of the catalogue describes: for these the right answer is ``unknown_cause``."""

import numpy as np

from tests.blind import dry, smooth
from tests.blind.causes import Cause, either, hidden_torque
from tests.blind.excitation import HIGHEST, LOWEST
from tests.blind.plan import Plan, Run
from tests.blind.wandering import random_curve


def tone(rng, joint):
    """A fan or a pump: one frequency that knows nothing of the motion, in every run."""
    frequency = rng.uniform(1.5, 9.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.torque(smooth.TONE, joint, size, frequency, run.rng.uniform(0.0, 2 * np.pi))

    return dict(install=install, start=1.5, slow=True, shape=(frequency,))


def friction_by_other_joint(rng, joint):
    """A cable or a bearing squeezed by the other joint's angle."""
    shape = rng.uniform(2.5, 5.0), rng.uniform(0.0, 2 * np.pi)
    return dict(install=hidden_torque(dry.OTHER_JOINT, joint, *shape), start=1.5, shape=shape)


def voltage_sag(rng, joint):
    """The supply sags when both motors run: torque is lost with the product of the speeds."""
    return dict(install=hidden_torque(smooth.BOTH_SPEEDS, joint, sign=either(rng)), start=3.0)


def cable_drag(rng, joint):
    """A cable bundle that settles ever anew: a drag that wanders within seconds, other in each run."""
    smoothing = rng.uniform(0.5, 1.5)

    def install(plan: Plan, size: float, run: Run) -> None:
        curve = random_curve(run.rng, run.duration_s, smoothing)
        curve -= np.interp(np.arange(len(curve)), [0, len(curve) - 1], [0.0, curve[-1]])
        curve /= np.sqrt(np.mean(curve**2))
        plan.torque(smooth.TABLE, joint, size, table=curve)

    return dict(install=install, start=2.0, slow=True, shape=(smoothing,))


def end_stop(rng, joint):
    """The frame touches a rubber stop inside the range, with nobody in it too."""
    side = either(rng)
    span = HIGHEST[joint] - LOWEST[joint]
    onset = (HIGHEST[joint] - 0.3 * span) if side > 0 else (LOWEST[joint] + 0.3 * span)
    shape = onset, rng.uniform(1.0, 1.5), side
    return dict(install=hidden_torque(smooth.END_POWER, joint, *shape), start=10.0, shape=shape)


def fading_gain(rng, joint):
    """A torque sensor that loses sensitivity as it warms."""
    sign, time = either(rng), rng.uniform(15.0, 40.0)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.fade[joint] = sign * size, time

    return dict(install=install, start=0.1, slow=True, shape=(sign, time))


def cross_talk(rng, joint):
    """A share of the other joint's torque leaks into this channel."""
    sign = either(rng)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.channel.cross[joint, 1 - joint] += sign * size

    return dict(install=install, start=0.1)


def ringing(rng, joint):
    """A cover that rings for a while after each reversal."""
    shape = rng.uniform(2.5, 7.0), rng.uniform(0.3, 0.8)
    return dict(
        install=hidden_torque(smooth.RINGING, joint, *shape, sign=either(rng)),
        start=3.0,
        shape=shape,
    )


def eccentric_encoder(rng, joint):
    """A magnetic encoder off its centre: the angle's error goes with the sine of a multiple of the angle."""
    phase = rng.uniform(0.0, 2 * np.pi)

    def install(plan: Plan, size: float, run: Run) -> None:
        plan.wobble[joint, :2] = size, phase

    return dict(install=install, start=0.08, largest=0.3, shape=(phase,))


def band_across_both_joints(rng, joint):
    """An elastic band from the pelvis to the shank, slack in one part of the range."""
    arms = rng.uniform(0.6, 1.0), rng.uniform(-1.0, -0.6)
    middle = float(np.dot(arms, (LOWEST + HIGHEST) / 2)) + rng.uniform(-0.2, 0.2)

    def install(plan: Plan, size: float, run: Run) -> None:
        for j in range(2):
            plan.torque(smooth.BIARTICULAR, j, size, *arms, arms[j], middle)

    return dict(install=install, start=5.0, shape=(*arms, middle))


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


def dead_zone_damper(rng, joint):
    """A damper that grips only above some speed."""
    threshold = rng.uniform(0.3, 0.8)
    install = hidden_torque(smooth.DEAD_ZONE, joint, threshold)
    return dict(install=install, start=3.0, shape=(threshold,), kin=("quadratic_drag",))


def detent(rng, joint):
    """A magnet that pulls the joint into one place."""
    place, width = rng.uniform(-0.2, 0.8), rng.uniform(0.1, 0.25)
    return dict(
        install=hidden_torque(smooth.DETENT, joint, place, width), start=3.0, shape=(place, width)
    )


def rough_patch(rng, joint):
    """A bearing that is rough on one side of the range."""
    place, width = rng.uniform(0.0, 0.6), rng.uniform(0.05, 0.3)
    return dict(
        install=hidden_torque(smooth.ROUGH, joint, place, width, either(rng)),
        start=2.0,
        shape=(place, width),
    )


OUTSIDE = (
    tone, friction_by_other_joint, voltage_sag, cable_drag, end_stop, fading_gain, cross_talk, ringing,
    eccentric_encoder, band_across_both_joints, kicks,
)  # fmt: skip


OF_ONE_JOINT = (
    tone, cable_drag, end_stop, fading_gain, ringing, eccentric_encoder, kicks, dead_zone_damper, detent, rough_patch,
)  # fmt: skip
"""What a machine of one joint can have of it, and more."""


def random_outside(rng, kind, joint: int) -> Cause:
    """Draw the shape of something that is not in the catalogue."""
    return Cause(
        effect=f"outside:{kind.__name__}",
        joint=joint,
        form=kind.__name__,
        own=False,
        **kind(rng, joint),
    )
