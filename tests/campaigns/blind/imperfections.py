"""What a good rig has too: several small effects at once, each below 1 % of the joint's rms
torque."""

from collections.abc import Sequence

from numpy.random import Generator

from tests.campaigns.blind.causes import Cause, Spec, log_uniform, random_cause
from tests.campaigns.blind.conditions import IMPERFECTIONS, LARGEST, SMALLEST
from tests.campaigns.blind.plan import HIP, KNEE

SMALL = (
    ("encoder_offset", HIP),
    ("encoder_offset", KNEE),
    ("torque_gain", HIP),
    ("torque_gain", KNEE),
    ("torque_offset", HIP),
    ("torque_offset", KNEE),
    ("time_delay", HIP),
    ("time_delay", KNEE),
    ("base_tilt", None),
    ("cogging", HIP),
    ("cogging", KNEE),
    ("mass_off_axis", KNEE),
    ("torque_drift", HIP),
    ("torque_drift", KNEE),
    ("joint_elasticity", HIP),
    ("rotor_inertia", KNEE),
    ("parallel_spring", HIP),
    ("parallel_spring", KNEE),
)
LEAST, MOST = 0.002, 0.009


def random_imperfections(
    rng: Generator, small: Sequence[Spec], world: str | None = None
) -> list[tuple[Cause, float]]:
    """Draw three to six effects of those that may be ``small``, and the magnitude of each."""
    if world is not None:
        small = [one for one in small if one in GOOD_RIG]
    chosen = rng.choice(len(small), size=int(rng.integers(3, 7)), replace=False)
    return [
        (random_cause(rng, *small[i], world=world), float(rng.uniform(LEAST, MOST)))
        for i in sorted(chosen)
    ]


def random_background(
    rng: Generator, world: str, hidden: Sequence[Spec]
) -> list[tuple[Cause, float]]:
    """Draw the small effects of a good rig, none of them of a kind that is hidden, and the
    magnitude of each."""
    taken = {effect for effect, _ in hidden}
    free = [one for one in GOOD_RIG if one[0] not in taken]
    count = int(rng.integers(IMPERFECTIONS[0], IMPERFECTIONS[1] + 1))
    chosen = rng.choice(len(free), size=count, replace=False)
    return [
        (random_cause(rng, *free[i], world=world), log_uniform(rng, SMALLEST, LARGEST))
        for i in sorted(chosen)
    ]


FRICTION = (
    "presliding_hysteresis",
    "coulomb_asymmetry",
    "viscous_asymmetry",
    "load_dependent_friction",
    "stribeck_friction",
    "friction_warmup",
)
GOOD_RIG = (
    *(one for one in SMALL if one[0] != "joint_elasticity"),
    *((effect, joint) for effect in FRICTION for joint in (HIP, KNEE)),
    *(("encoder_eccentricity", joint) for joint in (HIP, KNEE)),
    *(("torque_cross_talk", joint) for joint in (HIP, KNEE)),
    *(("position_dependent_friction", joint) for joint in (HIP, KNEE)),
    *(("gain_drift", joint) for joint in (HIP, KNEE)),
    ("mass_off_axis", HIP),
)
"""What may be a little off on any rig.

Its transmissions are stiff: behind soft ones a lab would tune the drives otherwise.
"""
