"""How large a hidden effect is: rms of its torque away from reversals over the joint's rms torque."""

from collections.abc import Callable, Sequence

import numpy as np

from tests.blind.causes import Cause
from tests.blind.floor import blocks, moving
from tests.blind.plan import HIP
from tests.blind.plant import Recorded

PASSES = 5
CLOSE = 0.04


def magnitude(cause: Cause, runs: Sequence[Recorded]) -> float:
    """Return the share, pooled over the runs in which the cause acts."""
    j = HIP if cause.joint is None else cause.joint
    acting = [r for r in runs if cause.acts_in(r.run.kind)]
    effect = np.concatenate([blocks(r.effect)[moving(r)[:, j], j] for r in acting])
    torque = np.concatenate([blocks(r.clean_torque)[moving(r)[:, j], j] for r in acting])
    return float(np.sqrt(np.mean(effect**2) / np.mean(torque**2)))


def size_for(cause: Cause, wanted: float, pilot: Callable[[float], Sequence[Recorded]]) -> float:
    """Find the size at which a cause has a magnitude, by simulating it alone a few times.

    The sizes that make a working leg win over the wish.
    """
    size = cause.start
    for _ in range(PASSES):
        found = magnitude(cause, pilot(size))
        if abs(found / wanted - 1.0) < CLOSE:
            break
        # Not more than a factor of six at once: from afar the leg may behave otherwise.
        new = float(np.clip(size * np.clip(wanted / found, 1 / 6, 6), cause.smallest, cause.largest))
        if new == size:
            break
        size = new
    return size
