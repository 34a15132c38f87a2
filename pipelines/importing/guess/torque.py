"""Fit a torque to a motion, for its sign and the direction of gravity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.quantities.consistency import whole_rows

FEWEST = 50
"""Least number of rows for a fit of five parameters."""


@dataclass(frozen=True)
class TorqueFit:
    """Torque of one joint as its inertia, gravity and friction, without other joints."""

    explained: float
    """Share of the torque's variance that the fit explains."""
    rival: float
    """The same of a wrong torque: this one, shifted in time."""
    inertia: float
    friction: float
    """Torque per rad/s², and Coulomb friction; in the torque's own unit."""
    down_rad: float
    """Angle at which the joint hangs, as gravity's torque vanishes, rad."""
    gravity_share: float
    """RMS of gravity's torque relative to that of the whole torque."""
    reach_rad: float
    """Range of the angle, rad; in a small range gravity resembles a constant torque."""

    @property
    def proves(self) -> bool:
        """Whether it explains clearly more than the fit of a wrong torque."""
        # Least share of the torque's variance that the motion must explain.
        follows = 0.7
        return self.explained >= follows and 1.0 - self.explained < 0.5 * (1.0 - self.rival)

    @property
    def backwards(self) -> bool:
        """Whether inertia and friction are negative, so that the torque has the wrong sign."""
        return self.inertia < 0.0 and self.friction < 0.0


def fit_torque(time_s: NDArray, angle_rad: NDArray, torque: NDArray) -> TorqueFit | None:
    """Fit ``tau = a ddq + b sgn dq + c sin q + d cos q + e`` by least squares.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    angle_rad : (n,) array
        Angle, rad, NaN where missing.
    torque : (n,) array
        Torque in any unit, NaN where missing.

    Returns
    -------
    TorqueFit or None
        None where nothing moves, or the log is too short.
    """
    time_s, angle_rad, torque = whole_rows(time_s, angle_rad, torque)
    if len(time_s) <= FEWEST or np.ptp(angle_rad) == 0.0 or np.ptp(torque) == 0.0:
        return None
    # Length of the parabola for the acceleration, s: short against a swing, long against a step.
    window_s = 0.1
    half = max(2, round(0.5 * window_s / float(np.median(np.diff(time_s)))))
    if len(time_s) < FEWEST + 2 * half:
        return None
    # Derivatives of the parabola through three angles, a window apart. A difference of neighbouring
    # rows would be noise.
    before, at, after = angle_rad[: -2 * half], angle_rad[half:-half], angle_rad[2 * half :]
    first, last = time_s[half:-half] - time_s[: -2 * half], time_s[2 * half :] - time_s[half:-half]
    # Both halves nearly equal: otherwise the slope is not that at the middle, as across a gap.
    regular = np.abs(first - last) < 0.2 * np.median(first)
    if np.count_nonzero(regular) < FEWEST:
        return None
    dq = (after - before) / (first + last)
    ddq = 2.0 * ((after - at) / last - (at - before) / first) / (first + last)
    # Averaged over the same window, so that it is smoothed about as the acceleration is.
    mean = np.convolve(torque, np.ones(2 * half + 1) / (2 * half + 1), "valid")
    # tanh in place of sgn: noise at standstill would reverse the friction at random.
    slow = 0.05 * float(np.std(dq)) + 1e-12
    Y = np.column_stack([ddq, np.tanh(dq / slow), np.sin(at), np.cos(at), np.ones_like(at)])[
        regular
    ]
    tau = mean[regular]
    # In a small motion cos q is nearly constant. The solution of least norm is then still unique.
    a, b, c, d, _ = np.linalg.lstsq(Y, tau, rcond=1e-8)[0]
    # Of a single sine any torque of the same period is explained: such a fit shows no sign.
    shifts = [round(share * len(tau)) for share in (0.05, 0.11, 0.17, 0.23, 0.31)]
    rivals = [_explained(Y[:-shift], tau[shift:]) for shift in shifts]
    gravity = Y[:, 2:4] @ np.array([c, d])
    return TorqueFit(
        explained=_explained(Y, tau),
        rival=float(np.median(rivals)),
        inertia=float(a),
        friction=float(b),
        # Both terms together are A sin(q - down), A > 0: the drive must lift the joint away from
        # down.
        down_rad=float(np.arctan2(-d, c)),
        gravity_share=float(np.std(gravity) / np.std(tau)),
        reach_rad=float(np.ptp(at)),
    )


def _explained(Y: NDArray, tau: NDArray) -> float:
    """Return the share of the variance of tau (m,) that columns of Y (m, 5) explain."""
    residual = tau - Y @ np.linalg.lstsq(Y, tau, rcond=1e-8)[0]
    return 1.0 - float(np.var(residual) / np.var(tau))
