"""Does torque do work with the motion, and where does gravity say that down is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.quantities.consistency import whole_rows

WINDOW_S = 0.1
"""Of the parabola whose bend is the acceleration: short against a swing, long against an encoder's
steps."""

FEWEST = 50
"""Rows from which a fit of five numbers says something."""


@dataclass(frozen=True)
class TorqueFit:
    """Torque of one joint as inertia, gravity and friction of that joint alone."""

    explained: float
    """Share of the torque's variance."""
    inertia: float
    friction: float
    """Torque for each rad/s², and with the direction of motion; in the torque's own unit."""
    down_rad: float
    """Angle at which gravity's torque vanishes and the joint would hang."""
    gravity_share: float
    """Gravity's torque, in rms over that of all the torque."""
    reach_rad: float
    """How far the joint moved; in a small motion gravity cannot be told from a constant torque."""

    @property
    def backwards(self) -> bool:
        """Whether both inertia and friction would be negative: the torque has the wrong sign."""
        return self.inertia < 0.0 and self.friction < 0.0


def fit_torque(time_s: NDArray, angle_rad: NDArray, torque: NDArray) -> TorqueFit | None:
    """Fit a ddq + b sgn dq + c sin q + d cos q + e to a torque (n,); None where nothing moves, or
    not for long."""
    time_s, angle_rad, torque = whole_rows(time_s, angle_rad, torque)
    half = (
        max(2, round(0.5 * WINDOW_S / float(np.median(np.diff(time_s)))))
        if len(time_s) > FEWEST
        else 0
    )
    if (
        not half
        or len(time_s) < FEWEST + 2 * half
        or np.ptp(angle_rad) == 0.0
        or np.ptp(torque) == 0.0
    ):
        return None
    before, at, after = angle_rad[: -2 * half], angle_rad[half:-half], angle_rad[2 * half :]
    first, last = time_s[half:-half] - time_s[: -2 * half], time_s[2 * half :] - time_s[half:-half]
    regular = np.abs(first - last) < 0.2 * np.median(first)
    if np.count_nonzero(regular) < FEWEST:
        return None
    dq = (after - before) / (first + last)
    ddq = 2.0 * ((after - at) / last - (at - before) / first) / (first + last)
    mean = np.convolve(torque, np.ones(2 * half + 1) / (2 * half + 1), "valid")
    slow = 0.05 * float(np.std(dq)) + 1e-12
    Y = np.column_stack([ddq, np.tanh(dq / slow), np.sin(at), np.cos(at), np.ones_like(at)])[
        regular
    ]
    tau = mean[regular]
    # Little motion makes cos q a constant: the shortest of all solutions then shares it between
    # both.
    a, b, c, d, e = np.linalg.lstsq(Y, tau, rcond=1e-8)[0]
    residual = tau - Y @ np.array([a, b, c, d, e])
    gravity = Y[:, 2:4] @ np.array([c, d])
    return TorqueFit(
        explained=1.0 - float(np.var(residual) / np.var(tau)),
        inertia=float(a),
        friction=float(b),
        down_rad=float(np.arctan2(-d, c)),
        gravity_share=float(np.std(gravity) / np.std(tau)),
        reach_rad=float(np.ptp(at)),
    )
