"""A multisine: odd harmonics of random phases, with detection lines left empty.

The phases are improved until the peaks of angle, velocity and acceleration are low relative to
their bounds, so that a motion within the bounds has as much power as possible.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from pipelines.design.fitness import costs
from pipelines.design.lines import excited_lines
from pipelines.design.search import Report, candidate_of, search_problem
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import bounds_array
from pipelines.settings.design import DesignSettings

STARTS = 10
"""Random phases that are improved at each joint; the best result of them is kept."""
NORMS = (4, 16, 64)
"""Orders of the norm that stands for the peak, one after another.

A descent on the peak itself would stop at the first phases that balance two peaks (Guillaume,
Schoukens, Pintelon and Kollar, 1991, IEEE Trans. Instrum. Meas. 40(6)).
"""


def multisine(
    settings: DesignSettings, geometry: Geometry, report: Report = lambda done, note: None
) -> tuple[FourierTrajectory, str]:
    """Design a multisine that keeps its bounds at every time.

    Both joints have the same lines and the same amplitudes, flat in velocity, each at the largest
    scale that its bounds allow.

    Parameters
    ----------
    settings : DesignSettings
        Bounds, harmonics and seed.
    geometry : Geometry
        Lengths and gravity.
    report : callable, optional
        Called with the share done, 0 to 1, and the lowest crest factor so far.

    Returns
    -------
    trajectory : FourierTrajectory
        The multisine.
    stopped_by : str
        ``stagnation``, or ``seconds`` where the time ended the search; then the result depends on
        the computer's speed.
    """
    omega = 2.0 * np.pi * settings.base_frequency_hz
    bounds = bounds_array(settings.bounds)
    # A motion of odd harmonics deviates as far up as down, so the middle leaves it most room.
    free = settings.theta0_rad == "free"
    theta0 = bounds[0].mean(axis=1) if free else np.array(settings.theta0_rad, dtype=float)
    half = half_ranges(bounds, theta0)
    lines = excited_lines(settings.harmonics, settings.seed)
    rng = np.random.default_rng(settings.seed)
    deadline = time.monotonic() + settings.seconds
    shape = []
    for joint in range(2):
        peaks = _Peaks.of(lines, omega, half[:, joint])
        best, lowest = np.zeros(len(lines)), np.inf
        for start in range(STARTS):
            phases = peaks.improved(rng.uniform(0.0, 2.0 * np.pi, len(lines)))
            if (crest := peaks.crest_factor(phases)) < lowest:
                best, lowest = phases, crest
            done = (joint + (start + 1) / STARTS) / 2
            report(done, f"crest factor {lowest:.3g}")
            if time.monotonic() > deadline:
                break
        shape.append(_coefficients(lines, best, settings.harmonics))
    stopped_by = "seconds" if time.monotonic() > deadline else "stagnation"
    hip, knee = (_scaled(c, omega, half[:, j]) for j, c in enumerate(shape))
    return _with_best_delay(hip, knee, theta0, settings, geometry), stopped_by


def half_ranges(bounds: NDArray, theta0: NDArray) -> NDArray:
    """Return the largest deviation of each quantity from its mean.

    Parameters
    ----------
    bounds : (3, J, 2) array
        Of angle, velocity and acceleration, SI units.
    theta0 : (J,) array
        Mean angles, rad.

    Returns
    -------
    (3, J) array
        To the nearer bound.
    """
    mean = np.zeros((3, len(theta0)))
    # Velocity and acceleration of a periodic motion have no mean.
    mean[0] = theta0
    return np.minimum(bounds[:, :, 1] - mean, mean - bounds[:, :, 0])


@dataclass(frozen=True)
class _Peaks:
    """Peaks of a joint's angle, velocity and acceleration relative to their bounds."""

    wave: NDArray
    """(N, k) complex harmonics over half a period."""
    amplitude: NDArray
    """(3, k) complex amplitudes in half ranges, at phase zero."""

    @classmethod
    def of(cls, lines: NDArray, omega: float, half: NDArray) -> "_Peaks":
        """Prepare the samples.

        Parameters
        ----------
        lines : (k,) array
            Excited harmonics, all odd.
        omega : float
            Angular frequency of the first harmonic, rad/s.
        half : (3,) array
            Half ranges, rad, rad/s and rad/s².
        """
        # The second half period of odd harmonics is the negative of the first.
        samples = 8 * int(lines[-1])
        x = np.pi * np.arange(samples) / samples
        # Velocities of size one: the angle is the integral, the acceleration the derivative.
        order = np.arange(-1.0, 2.0)[:, np.newaxis]
        amplitude = (1j * omega * lines) ** order / half[:, np.newaxis]
        return cls(np.exp(1j * np.outer(x, lines)), amplitude)

    def crest_factor(self, phases: NDArray) -> float:
        """Return the largest peak over the largest rms, both relative to the bounds."""
        c = self.amplitude * np.exp(1j * phases)
        x = (self.wave @ c.T).real
        rms = np.sqrt(0.5 * np.sum(np.abs(self.amplitude) ** 2, axis=1))
        return float(np.abs(x).max() / rms.max())

    def improved(self, phases: NDArray) -> NDArray:
        """Return phases (k,) with lower peaks, near some phases (k,)."""
        for order in NORMS:
            phases = minimize(
                self.norm, phases, (order,), jac=True, method="L-BFGS-B", options={"maxiter": 300}
            ).x
        return phases

    def norm(self, phases: NDArray, order: int) -> tuple[float, NDArray]:
        """Return the logarithm of the norm of all samples and its gradient.

        Parameters
        ----------
        phases : (k,) array
            rad.
        order : int
            Of the norm, even.

        Returns
        -------
        value : float
            It nears the logarithm of the largest peak as the order grows.
        gradient : (k,) array
            By the phases.
        """
        c = self.amplitude * np.exp(1j * phases)
        x = self.wave.real @ c.T.real - self.wave.imag @ c.T.imag
        # Relative to the peak, or high powers would overflow.
        peak = np.abs(x).max()
        power = (x / peak) ** (order - 1)
        total = np.sum(power * x) / peak
        value = np.log(peak) + np.log(total / x.size) / order
        # A phase turns its harmonic: the derivative of Re(c e^(ikx)) is -Im(c e^(ikx)).
        turned = (power.T @ self.wave.imag) * c.real + (power.T @ self.wave.real) * c.imag
        return float(value), -turned.sum(axis=0) / (peak * total)


def _coefficients(lines: NDArray, phases: NDArray, harmonics: int) -> NDArray:
    """Return sine and cosine coefficients (2, n) of angles with velocities of size one."""
    # The angle Re(e^(i (k w t + phase)) / (i k)) has the velocity w cos(k w t + phase).
    angle = np.exp(1j * phases) / (1j * lines)
    coefficients = np.zeros((2, harmonics))
    coefficients[:, lines - 1] = -angle.imag, angle.real
    return coefficients


def _scaled(coefficients: NDArray, omega: float, half: NDArray) -> NDArray:
    """Return coefficients (2, n) of one joint whose motion just touches its bounds."""
    still = np.zeros((2, 2, coefficients.shape[1]))
    still[0] = coefficients
    peak = np.abs(_trajectory(still, np.zeros(2), omega).extrema()[:, 0]).max(axis=1)
    return coefficients * np.min(half / peak)


def _trajectory(parts: NDArray, theta0: NDArray, omega: float) -> FourierTrajectory:
    """Return the motion of coefficients (joint, sine or cosine, n)."""
    return FourierTrajectory(theta0, parts[:, 0].copy(), parts[:, 1].copy(), omega)


def _with_best_delay(
    hip: NDArray, knee: NDArray, theta0: NDArray, settings: DesignSettings, geometry: Geometry
) -> FourierTrajectory:
    """Return both joints, the knee delayed to where the regressor's log det is largest.

    A delay changes no peak. Without a choice of it, both joints may move nearly alike, and their
    inertias and friction are not separated.
    """
    omega = 2.0 * np.pi * settings.base_frequency_hz
    by_log_det = settings.model_copy(update={"theta0_rad": tuple(theta0)})
    problem = search_problem(by_log_det, geometry, samples=200, samples_per_harmonic=40)
    k = np.arange(1, settings.harmonics + 1)
    angle = knee[1] - 1j * knee[0]
    motions = []
    for turn in 2.0 * np.pi * np.arange(4 * settings.harmonics) / (4 * settings.harmonics):
        turned = angle * np.exp(1j * k * turn)
        delayed = np.array([-turned.imag, turned.real])
        motions.append(_trajectory(np.array([hip, delayed]), theta0, omega))
    candidates = np.array([candidate_of(motion, problem) for motion in motions])
    return motions[int(np.argmin(costs(candidates, problem)))]
