"""What a good rig has too: several small effects at once, each below 1 % of the joint's rms torque."""

from collections.abc import Sequence

from numpy.random import Generator

from tests.blind.causes import Cause, Spec, random_cause
from tests.blind.plan import HIP, KNEE

SMALL = (
    ("encoder_offset", HIP), ("encoder_offset", KNEE), ("torque_gain", HIP), ("torque_gain", KNEE),
    ("torque_offset", HIP), ("torque_offset", KNEE), ("time_delay", HIP), ("time_delay", KNEE), ("base_tilt", None),
    ("cogging", HIP), ("cogging", KNEE), ("mass_off_axis", KNEE), ("torque_drift", HIP), ("torque_drift", KNEE),
    ("joint_elasticity", HIP), ("rotor_inertia", KNEE), ("parallel_spring", HIP), ("parallel_spring", KNEE),
)  # fmt: skip
LEAST, MOST = 0.002, 0.009


def random_imperfections(rng: Generator, small: Sequence[Spec]) -> list[tuple[Cause, float]]:
    """Draw three to six effects of those that may be ``small``, and the magnitude of each."""
    chosen = rng.choice(len(small), size=int(rng.integers(3, 7)), replace=False)
    return [(random_cause(rng, *small[i]), float(rng.uniform(LEAST, MOST))) for i in sorted(chosen)]
