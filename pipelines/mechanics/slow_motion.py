"""The part of a motion below a cut-off lower than its own."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.mechanics.motion import Motion
from pipelines.mechanics.stretches import edge
from pipelines.signals.blocks import dilate
from pipelines.signals.low_pass import derivative, low_pass, shortest


def unsure(motion: Motion, cutoff_hz: float) -> NDArray:
    """Return which samples lack one side of the filter, or are near invalid samples.

    A stretch that is too short for the filter is marked as a whole.

    Parameters
    ----------
    motion : Motion
        n samples.
    cutoff_hz : float
        Cut-off of the filter, Hz.

    Returns
    -------
    (n,) bool array
        True for samples to leave out.
    """
    rate = motion.sample_rate_hz
    reach, near = edge(rate, cutoff_hz), np.zeros(len(motion), dtype=bool)
    for stretch in motion.segments():
        if stretch.stop - stretch.start < shortest(rate, cutoff_hz):
            near[stretch] = True
            continue
        # At both ends the filter lacks samples on one side.
        near[stretch.start : stretch.start + reach] = True
        near[max(stretch.start, stretch.stop - reach) : stretch.stop] = True
        inner = slice(stretch.start + reach, max(stretch.start + reach, stretch.stop - reach))
        if not motion.valid[inner].all():  # The ends are already marked.
            near[inner] |= dilate(~motion.valid[inner], reach)
    return near


def filtered(motion: Motion, x: NDArray, cutoff_hz: float) -> NDArray:
    """Return the part of a signal below a cut-off.

    Parameters
    ----------
    motion : Motion
        n samples, whose stretches are filtered one by one.
    x : (n, ...) array
        A signal along the motion.
    cutoff_hz : float
        Hz.

    Returns
    -------
    (n, ...) array
        In the unit of ``x``; stretches too short for the filter stay as they are.
    """
    slow = np.array(x, dtype=float)
    for stretch in motion.segments():
        if stretch.stop - stretch.start >= shortest(motion.sample_rate_hz, cutoff_hz):
            slow[stretch] = low_pass(slow[stretch], motion.sample_rate_hz, cutoff_hz)
    return slow


def below(motion: Motion, cutoff_hz: float) -> Motion:
    """Return the part of a motion below a cut-off.

    Parameters
    ----------
    motion : Motion
        n samples.
    cutoff_hz : float
        Hz, lower than the motion's own.

    Returns
    -------
    Motion
        n samples, without loads; samples near ends and gaps are invalid.
    """
    rate = motion.sample_rate_hz
    # Velocity and acceleration are differentiated again, so that all three have the same band.
    q, dq, ddq = filtered(motion, motion.q, cutoff_hz), motion.dq.copy(), motion.ddq.copy()
    for stretch in motion.segments():
        if stretch.stop - stretch.start >= shortest(rate, cutoff_hz):
            dq[stretch], ddq[stretch] = (derivative(q[stretch], rate, order) for order in (1, 2))
    valid = motion.valid & ~unsure(motion, cutoff_hz)
    # Loads and bodies were estimated from the faster motion, and do not apply to this one.
    estimated: dict[str, Any] = dict.fromkeys(("load", "limb_load", "body", "limb_body"))
    slow = replace(motion, q=q, dq=dq, ddq=ddq, valid=valid, cutoff_hz=cutoff_hz)
    return replace(slow, **estimated)
