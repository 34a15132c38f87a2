"""The excitation as a finite Fourier series: periodic, with exact derivatives and extrema."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import HIP_AND_KNEE, Joint


@dataclass(frozen=True)
class FourierTrajectory:
    """q(t) = theta0 + sum over k = 1..n of a_k sin(k w t) + b_k cos(k w t).

    Source: paper, eq. 11, as corrected in docs/errata.md. J joints, n harmonics, SI units.
    """

    theta0: NDArray
    """(J,) mean angle, rad."""
    a: NDArray
    """(J, n) sine coefficients, rad."""
    b: NDArray
    """(J, n) cosine coefficients, rad."""
    omega: float
    """Angular frequency of the first harmonic, rad/s."""
    joints: tuple[Joint, ...] = HIP_AND_KNEE

    @property
    def period_s(self) -> float:
        """Time after which the motion repeats."""
        return 2.0 * np.pi / self.omega

    @property
    def duration_s(self) -> float:
        """Time for which the motion can run, s."""
        return np.inf

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
        phase = np.exp(1j * np.outer(np.atleast_1d(time), self._frequencies))
        q, dq, ddq = ((phase @ amplitude.T).real for amplitude in self._amplitudes)
        return self.theta0 + q, dq, ddq

    def extrema(self) -> NDArray:
        """Return the least and greatest angle, velocity and acceleration.

        Returns
        -------
        (3, J, 2) array
            Quantity, joint, least and greatest; rad, rad/s and rad/s².
        """
        ranges = np.array([list(map(_range, amplitude)) for amplitude in self._amplitudes])
        # Velocity and acceleration of a periodic motion have no mean.
        ranges[0] += self.theta0[:, np.newaxis]
        return ranges

    @property
    def excited_lines(self) -> list[int]:
        """Numbers of the harmonics that any joint moves at."""
        size = np.hypot(self.a, self.b).max(axis=0)
        # Coefficients of a file may be rounded, but an empty line is exactly zero in any.
        return [int(k) for k in np.flatnonzero(size > 0.0) + 1]

    @property
    def has_detection_lines(self) -> bool:
        """Whether all even harmonics, and some odd ones below the highest, are empty."""
        excited = self.excited_lines
        if not excited or any(k % 2 == 0 for k in excited):
            return False
        return len(excited) < len(range(1, self.a.shape[1] + 1, 2))

    @property
    def _frequencies(self) -> NDArray:
        return self.omega * np.arange(1, self.a.shape[1] + 1)

    @cached_property
    def _amplitudes(self) -> NDArray:
        """Complex amplitudes of q, dq and ddq, (3, J, n).

        a sin x + b cos x = Re (b - i a) e^(i x).
        """
        angle = self.b - 1j * self.a
        return np.array([angle * (1j * self._frequencies) ** order for order in range(3)])


def _range(amplitude: NDArray) -> tuple[float, float]:
    """Return the least and the greatest value of Re sum c_k e^(i k x) over all x.

    With z = e^(ix), the derivative is a polynomial of degree 2n over z^n; every extremum lies at
    the argument of a root. The arguments of the other roots only add points.
    """
    n = len(amplitude)
    slope = 1j * np.arange(1, n + 1) * amplitude
    roots = np.roots(np.concatenate([slope[::-1], [0.0], slope.conj()]))
    # A joint at rest has no roots, and then 0 is the only point.
    x = np.append(np.angle(roots), 0.0)
    values = (np.exp(1j * np.outer(x, np.arange(1, n + 1))) @ amplitude).real
    return float(values.min()), float(values.max())
