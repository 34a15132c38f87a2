"""Simulate a recording: under its torque, and in its drives' loop under its references."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.contracts.joints import columns_of, the
from pipelines.dynamics.pd_loop import (
    Drives,
    LoopState,
    follow,
    loop_at_rest,
    make_drives,
    read_encoders,
)
from pipelines.dynamics.plant import Plant
from pipelines.dynamics.replay import ReplayResult, known_temperature
from pipelines.mechanics.motion import Motion


@dataclass(frozen=True)
class UnderReferences:
    """The simulated motion, at the n samples of the measured one; J joints."""

    angle: NDArray
    """(n, J) simulated encoder angle, rad."""
    velocity: NDArray
    torque: NDArray
    """(n, J) simulated torque as the drives report it, N·m."""
    angle_rmse: NDArray
    """(J,) rad, over valid samples."""
    torque_rmse: NDArray
    """(J,) N·m."""


def why_no_closed_loop(motion: Motion) -> str:
    """Return why a recording's drives cannot be simulated in closed loop; empty if they can."""
    controller = motion.metadata.get("controller") or {}
    for joint in motion.joints:
        about = controller.get(joint)
        if about is None:
            return f"its metadata names no controller of {the(joint)}"
        if about["type"].lower() != "pd":
            return (
                f"the controller of its {joint} is of type {about['type']}, and exoid simulates pd"
                " only"
            )
        if about.get("kp_nm_rad") is None or about.get("kd_nm_s_rad") is None:
            return f"the controller of its {joint} lacks kp_nm_rad or kd_nm_s_rad"
    if motion.reference is None:
        return "it holds no references"
    if not np.isfinite(motion.reference).all():
        return "its references have missing values"
    return ""


def follow_references(plant: Plant, motion: Motion) -> UnderReferences:
    """Simulate a plant along a motion's references under the drives that its metadata names.

    Every segment begins in its recorded state. ``why_no_closed_loop`` must be empty.
    """
    drives, temperature = _drives(motion), known_temperature(motion)
    simulated = [np.full(motion.q.shape, np.nan) for _ in range(3)]
    assert motion.reference is not None
    for segment in motion.segments():
        period = 1.0 / motion.sample_rate_hz
        loop = _loop_as_recorded(plant, motion, segment.start, period)
        reference = np.ascontiguousarray(motion.reference[segment])
        # The loop measures in the middle of a period, which is to be the time of a sample.
        begin = motion.time[segment.start] - 0.5 * period
        followed = follow(plant.assembly, drives, loop, reference, begin, temperature[segment])
        # The fourth result of `follow`, the true motion, is dropped.
        for whole, part in zip(simulated, followed, strict=False):
            whole[segment] = part
    angle, velocity, torque = simulated
    angle_rmse = _rms((motion.q - angle)[motion.valid])
    torque_rmse = _rms((motion.torque - torque)[motion.valid])
    return UnderReferences(angle, velocity, torque, angle_rmse, torque_rmse)


def _drives(motion: Motion) -> Drives:
    of_joints = [motion.metadata["controller"][joint] for joint in motion.joints]
    return make_drives(
        kp=np.array([c["kp_nm_rad"] for c in of_joints], dtype=float),
        kd=np.array([c["kd_nm_s_rad"] for c in of_joints], dtype=float),
        limit=np.array([c.get("limit_nm") or 1e9 for c in of_joints]),  # by default none
        # Metadata do not hold the encoders' resolution.
        counts_per_turn=np.zeros(len(of_joints)),
        # All joints share one loop, at the rate of the fastest drive.
        rate_hz=max(c.get("rate_hz") or motion.sample_rate_hz for c in of_joints),
        sample_rate_hz=motion.sample_rate_hz,
    )


def _loop_as_recorded(plant: Plant, motion: Motion, k: int, period: float) -> LoopState:
    """Return the loop in the recorded state half a period before the time of sample ``k``."""
    motor = plant.model.sensed(motion)
    link = plant.model.behind_motors(motor)
    state = np.stack([link.q[k], link.dq[k], motor.q[k], motor.dq[k]])
    # Both angles half a period earlier, at their recorded speeds.
    state[::2] -= 0.5 * period * state[1::2]
    at_rest = loop_at_rest(plant.assembly, link.q[k])
    # The drives control what the encoders read, and not the motors' true angles.
    counted = state[2].copy()
    read_encoders(plant.assembly, counted)
    assert motion.reference is not None
    ahead = motion.reference[min(k + 1, len(motion) - 1)]
    return at_rest._replace(
        state=state,
        angle=counted,
        speed=motor.dq[k].copy(),
        # Extrapolated to the sample before, from which the drives go to the first set-point.
        reference=2.0 * motion.reference[k] - ahead,
    )


def _rms(x: NDArray) -> NDArray:
    return np.sqrt(np.mean(x**2, axis=0))


def open_loop_frame(
    replayed: ReplayResult, motion: Motion, joints: tuple[Joint, ...]
) -> pd.DataFrame:
    """Return the windows that follow each other without overlap as a ``simulation/1`` table.

    The recorded angle stands as the reference; ``window`` numbers the windows.
    """
    chosen = _without_overlap(replayed.first, replayed.angle.shape[1] - 1)
    which = np.searchsorted(replayed.first, chosen)
    # A window's last sample is the next one's first.
    rows = (chosen[:, np.newaxis] + np.arange(replayed.angle.shape[1] - 1)).ravel()

    def joined(windows: NDArray) -> NDArray:
        return windows[which, :-1].reshape(len(rows), -1)

    angle, error = joined(replayed.angle), joined(replayed.error)
    columns = {"time_s": motion.time[rows], "window": np.repeat(which, replayed.angle.shape[1] - 1)}
    quantities = {
        "reference": angle + error,
        "angle": angle,
        "velocity": joined(replayed.velocity),
        "error": error,
        "torque": motion.torque[rows],
        "network": np.full_like(angle, np.nan),
    }
    return pd.DataFrame(columns | columns_of(joints, quantities))


def _without_overlap(first: NDArray, length: int) -> NDArray:
    chosen = [first[0]]
    for start in first[1:]:
        if start >= chosen[-1] + length:
            chosen.append(start)
    return np.array(chosen)


def closed_loop_frame(
    simulated: UnderReferences, motion: Motion, joints: tuple[Joint, ...]
) -> pd.DataFrame:
    """Return simulated and measured motion as a ``simulation/1`` table."""
    assert motion.reference is not None
    quantities = {
        "reference": motion.reference,
        "angle": simulated.angle,
        "velocity": simulated.velocity,
        "error": motion.reference - simulated.angle,
        "torque": simulated.torque,
        "network": np.full_like(motion.q, np.nan),
        "angle_measured": motion.q,
        "torque_measured": motion.torque,
    }
    return pd.DataFrame({"time_s": motion.time} | columns_of(joints, quantities))
