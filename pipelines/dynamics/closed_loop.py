"""Simulate a model along a run's references, under the same drives.

The result has the run's excitation without its sensors' noise, and so serves as instruments of a
regression.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import the
from pipelines.dynamics.assembly import Assembly, assemble
from pipelines.dynamics.forward import DQ, DTHETA
from pipelines.dynamics.mobility import masses
from pipelines.dynamics.pd_loop import Drives, follow, loop_at_rest, make_drives
from pipelines.dynamics.replay import known_temperature
from pipelines.errors import InputError
from pipelines.mechanics.motion import Motion
from pipelines.model import Model


def closed_loop(model: Model, motion: Motion) -> Motion:
    """Return the run's motion as a model performs it along the references.

    The drives are those of the recording's ``controller``. Without them, loops of a bandwidth of 8
    Hz are used, tuned to the model's inertia, as in DIDIM (Gautier, Janot and Vandanjon, 2013, IEEE
    TCST 21(2)).

    Raises
    ------
    InputError
        If the run has no references, or the simulation diverges.
    """
    reference = _set_points(motion)
    a = assemble(model.for_run(motion.run), motion.geometry, motion.joints)
    drives, temperature = _drives(motion, a), known_temperature(motion)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    for stretch in motion.segments():
        loop = loop_at_rest(a, motion.q[stretch.start])
        # A stretch that began at rest would have to catch up first.
        loop.state[[DQ, DTHETA]] = loop.speed[:] = motion.dq[stretch.start]
        loop.reference[:] = reference[stretch.start]
        start, warmth = motion.time[stretch.start], temperature[stretch]
        # The true motion of the links, because instruments are to be free of the sensors' errors.
        truth = follow(a, drives, loop, reference[stretch], start, warmth)[3]
        q[stretch], dq[stretch], ddq[stretch] = truth[:, 0], truth[:, 1], truth[:, 2]
    if not np.isfinite(ddq).all():
        raise InputError(
            f"{motion.file or 'the motion'}: the simulation diverges under the run's own drives; "
            "check the metadata `controller`, or choose --method weighted_least_squares"
        )
    return replace(motion, q=q, dq=dq, ddq=ddq)


def _set_points(motion: Motion) -> NDArray:
    """Return the commanded angles, (n, J) rad, linear between recorded ones."""
    reference = np.full_like(motion.q, np.nan) if motion.reference is None else motion.reference
    lines = []
    for joint, column in zip(motion.joints, reference.T, strict=True):
        known = np.isfinite(column)
        if not known.any():
            raise InputError(
                f"{motion.file or 'the motion'}: has no set-points of {the(joint)}, which a"
                " simulation of its closed loop follows; record them with the run, or choose a"
                " --method that needs none"
            )
        lines.append(np.interp(motion.time, motion.time[known], column[known]))
    return np.ascontiguousarray(np.column_stack(lines))


def _drives(motion: Motion, a: Assembly) -> Drives:
    # Bandwidth of the loop that replaces unknown drives.
    bandwidth_rad_s = 2.0 * np.pi * 8.0
    controller: Mapping[str, Any] = motion.metadata.get("controller") or {}
    each = [controller.get(joint) or {} for joint in motion.joints]
    # Rate of drives that report none, and the highest that is simulated; a faster one changes
    # nothing in a regression.
    highest_hz = 1000.0
    if all(_gain(c, "kp") for c in each):
        kp, kd, limit, rate = (
            np.array([_gain(c, key) for c in each]) for key in ("kp", "kd", "limit", "rate_hz")
        )
        limit = np.where(limit > 0.0, limit, np.inf)
        rate = np.where(rate > 0.0, rate, highest_hz)
    else:
        mass = masses(a)[0].mean(axis=0).diagonal()
        # Two equal poles at the bandwidth: critical damping at the mean inertia of each joint.
        kp, kd = bandwidth_rad_s**2 * mass, 2.0 * bandwidth_rad_s * mass
        limit, rate = np.full(len(mass), np.inf), np.full(len(mass), highest_hz)
    rate_hz = max(min(highest_hz, *rate), motion.sample_rate_hz)
    # Ideal encoders, since counts would add noise to the instruments.
    return make_drives(kp, kd, limit, np.zeros(len(each)), rate_hz, motion.sample_rate_hz)


def _gain(controller: Mapping[str, Any], key: str) -> float:
    """Return a drive's value by its name without unit; 0 if it is missing."""
    return next(
        (float(v) for k, v in controller.items() if k.startswith(key) and v is not None), 0.0
    )
