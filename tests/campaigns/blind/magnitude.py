"""How large a hidden effect is: rms of its torque away from reversals over the rms of the joint's,
a weight apart."""

from collections.abc import Callable, Sequence

import numpy as np

from tests.campaigns.blind.causes import Cause
from tests.campaigns.blind.plan import HIP
from tests.campaigns.blind.recorded import Recorded

PASSES = 7
CLOSE = 0.04
ACTS, OF_LARGEST, LEAST_AT_LARGEST = 0.3, 0.9, 0.012
"""Share of the wanted magnitude that has to come of a size below this share of the largest, and
the magnitude that has to come of the largest."""
FARTHEST = 5.0
"""Factor by which a size changes at once: from afar the leg may behave otherwise."""


def magnitude(cause: Cause, runs: Sequence[Recorded]) -> float:
    """Return the share, pooled over the runs in which the cause acts."""
    effect, torque = rms(cause, runs)
    return effect / torque


def rms(cause: Cause, runs: Sequence[Recorded]) -> tuple[float, float]:
    """Return rms of what is hidden and of the torque, N·m, away from reversals, over the runs where
    the cause acts."""
    j = HIP if cause.joint is None else cause.joint
    acting = [r for r in runs if cause.acts_in(r.run.kind)]
    # Torque faster than blocks is given sample by sample.
    rows = [(r.moving_samples() if cause.fast else r.moving())[:, j] for r in acting]
    shown = [(lambda x: x) if cause.fast else r.blocks for r in acting]
    several = list(zip(acting, rows, shown, strict=True))
    hidden = np.concatenate([of(r.effect)[moving, j] for r, moving, of in several])
    torque = np.concatenate([of(r.clean_torque)[moving, j] - r.weight for r, moving, of in several])
    if not len(hidden):
        raise FloatingPointError("the simulated leg is stuck")
    return float(np.sqrt(np.mean(hidden**2))), float(np.sqrt(np.mean(torque**2)))


def size_for(
    cause: Cause,
    wanted: float,
    pilot: Callable[[float], Sequence[Recorded]],
    must_act: bool = False,
) -> float:
    """Find the size at which a cause has a magnitude, by simulating it alone a few times.

    The sizes that make a working leg win over the wish. With ``must_act`` a cause that does nothing
    along these motions raises FloatingPointError.
    """
    size, low, high = cause.start, cause.smallest, cause.largest
    for _ in range(PASSES):
        try:
            reached = magnitude(cause, pilot(size))
        except FloatingPointError:  # unstable or stuck: far too large
            reached = np.inf
        if abs(reached / wanted - 1.0) < CLOSE:
            break
        low, high = (size, high) if reached < wanted else (low, size)
        if high <= low * (1.0 + CLOSE):
            break
        new = size * float(np.clip(wanted / reached, 1 / FARTHEST, FARTHEST))
        new = float(np.clip(new, cause.smallest, cause.largest))
        # What is far from proportional is bisected.
        size = new if low <= new <= high else float(np.sqrt(low * high))
    least = LEAST_AT_LARGEST if size >= OF_LARGEST * cause.largest else ACTS * wanted
    if must_act and reached < least:
        raise FloatingPointError(f"{cause.label} does not act on this motion")
    return size


def small_size_for(
    cause: Cause, wanted: float, pilot: Callable[[float], Sequence[Recorded]]
) -> float:
    """Return the size at which a cause has a small magnitude, in proportion to that of one larger
    size."""
    size = cause.start
    for _ in range(3):
        try:
            reached = magnitude(cause, pilot(size))
        except FloatingPointError:
            reached = np.inf
        if np.isfinite(reached) and reached > 0:
            return float(min(size * wanted / reached, cause.largest))
        size *= 0.2
    raise FloatingPointError(f"{cause.label} has no size")
