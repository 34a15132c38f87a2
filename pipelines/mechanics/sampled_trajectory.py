"""An excitation known at samples only, as other tools may write it, with splines between them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PPoly

from pipelines.contracts.joints import HIP_AND_KNEE, Joint


@dataclass(frozen=True)
class SampledTrajectory:
    """A motion through n samples of J joints, with the interface of ``FourierTrajectory``.

    Angle and velocity are Hermite splines through the samples with their given slopes.
    """

    time: NDArray
    """(n,) s, from the first sample on."""
    q: NDArray
    """(n, J) angles, rad."""
    dq: NDArray
    """(n, J) velocities, rad/s."""
    ddq: NDArray
    """(n, J) accelerations, rad/s²."""
    period_s: float | None = None
    """Time after which the samples repeat; None if the motion runs once."""
    joints: tuple[Joint, ...] = HIP_AND_KNEE

    @property
    def duration_s(self) -> float:
        """Time for which the motion can run, s."""
        return np.inf if self.period_s else float(self.time[-1] - self.time[0])

    def at(self, time: NDArray | float) -> tuple[NDArray, NDArray, NDArray]:
        """Return angle, velocity and acceleration at some times.

        Parameters
        ----------
        time : (n,) array or float
            Times, s.

        Returns
        -------
        q, dq, ddq : (n, J) array
            rad, rad/s and rad/s².
        """
        time = np.atleast_1d(np.asarray(time, dtype=float))
        if self.period_s:
            time = np.mod(time, self.period_s)
        q, dq, ddq = (spline(time) for spline in self._splines)
        return q, dq, ddq

    def extrema(self) -> NDArray:
        """Return the least and greatest angle, velocity and acceleration.

        Returns
        -------
        (3, J, 2) array
            Quantity, joint, least and greatest; rad, rad/s and rad/s².
        """
        joints = range(len(self.joints))
        return np.array([[_range(spline, j) for j in joints] for spline in self._splines])

    @cached_property
    def _splines(self) -> tuple[PPoly, PPoly, PPoly]:
        time, (q, dq, ddq) = self.time - self.time[0], (self.q, self.dq, self.ddq)
        # A table of one period ends a sample before it repeats; its first row closes the period.
        if self.period_s and time[-1] < self.period_s - 1e-9:
            time = np.append(time, self.period_s)
            q, dq, ddq = (np.vstack([x, x[:1]]) for x in (q, dq, ddq))
        # Each quantity has the next one's samples as slopes; those of the acceleration are unknown.
        return (
            CubicHermiteSpline(time, q, dq),
            CubicHermiteSpline(time, dq, ddq),
            CubicSpline(time, ddq),
        )


def _range(spline: PPoly, joint: int) -> tuple[float, float]:
    """Return the least and the greatest value of one joint's piecewise cubic."""
    of_joint = PPoly(spline.c[:, :, joint], spline.x)
    turns = of_joint.derivative().roots(discontinuity=False, extrapolate=False)
    # A constant piece has its extrema everywhere, which scipy reports as NaN.
    values = of_joint(np.concatenate([of_joint.x, turns[np.isfinite(turns)]]))
    return float(values.min()), float(values.max())
