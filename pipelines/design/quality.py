"""The quality of an excitation: condition numbers, log det, and expected standard errors."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from pipelines.errors import InputError
from pipelines.estimation.regression import away_from_reversals
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import Margin, bounds_array, margins
from pipelines.mechanics.machine import THE_LEG
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.trajectory import Trajectory
from pipelines.model import Model, baseline
from pipelines.settings.design import DesignSettings, JointBounds, NoiseSettings


@dataclass(frozen=True)
class Quality:
    """The quality of an excitation, by the eight columns of its regressor.

    The columns are those of X1 .. X4, then of each joint's friction.
    """

    condition: float
    """Condition number of the unscaled regressor, the paper's criterion."""
    inertial_condition: float
    """Condition number of the four inertial columns alone."""
    scaled_condition: float
    """Condition number with columns of unit norm, independent of units."""
    log_det: float
    """log det of A'A/N."""
    crest_factor: float
    """Largest peak of angle, velocity and acceleration over their largest rms, of the joint where
    it is larger; peaks and rms as shares of the bounds."""
    standard_errors: dict[str, float]
    """Expected standard error of each parameter, in its unit."""
    units: dict[str, str]
    margins: list[Margin]

    def value(self, criterion: str) -> float:
        """Return the value of a criterion."""
        return float(getattr(self, "crest_factor" if criterion == "multisine" else criterion))

    def as_metadata(self) -> dict[str, Any]:
        """Return the quality for the metadata of ``trajectory/1``."""
        names = ("condition", "scaled_condition", "log_det", "inertial_condition", "crest_factor")
        return {
            **_finite({name: getattr(self, name) for name in names}),
            "standard_errors": _finite(self.standard_errors),
            "margins": [{**vars(margin), "margin": margin.margin} for margin in self.margins],
        }


def _finite(numbers: dict[str, float]) -> dict[str, float | None]:
    return {name: value if np.isfinite(value) else None for name, value in numbers.items()}


def quality(trajectory: Trajectory, settings: DesignSettings, geometry: Geometry) -> Quality:
    """Assess an excitation over a whole period, without the search's approximations.

    Raises
    ------
    InputError
        If it moves joints other than hip and knee.
    """
    names = tuple(joint.name for joint in trajectory.joints)
    if names != ("hip", "knee"):
        raise InputError(
            f"the excitation moves the joints {', '.join(names)}, expected hip and knee"
        )
    span = trajectory.period_s or trajectory.duration_s
    samples = 1000
    A = regressor(trajectory, geometry, np.arange(samples) * span / samples)
    stacked = A.reshape(-1, A.shape[2])
    size = np.linalg.norm(stacked, axis=0)
    parameters = _parameters()
    errors = standard_errors(trajectory, settings.noise, geometry, settings.sample_rate_hz)
    return Quality(
        condition=_condition(stacked),
        inertial_condition=_condition(stacked[:, : len(LEG.parameters)]),
        # A joint at rest has a column of zeros, which stays zero: the condition is infinite.
        scaled_condition=_condition(stacked / np.where(size > 0.0, size, 1.0)),
        log_det=float(np.linalg.slogdet(stacked.T @ stacked / samples)[1]),
        crest_factor=crest_factor(trajectory, settings.bounds),
        standard_errors=dict(zip(parameters, errors.tolist(), strict=True)),
        units=parameters,
        margins=margins(trajectory, settings.bounds),
    )


def crest_factor(trajectory: Trajectory, bounds: JointBounds) -> float:
    """Return the largest peak of a motion over its largest rms, both as shares of the bounds.

    Where one quantity is limiting, it is that quantity's crest factor, 1.41 for a sine. A low one
    means much power within the bounds.

    Parameters
    ----------
    trajectory : Trajectory
        Motion of hip and knee.
    bounds : JointBounds
        Limits of hip and knee.

    Returns
    -------
    float
        Of the joint where it is larger, among those that move; NaN if none does.
    """
    span, samples = trajectory.period_s or trajectory.duration_s, 1000
    states = np.array(trajectory.at(np.arange(samples) * span / samples))
    half = 0.5 * np.ptp(bounds_array(bounds), axis=2)
    rms = states.std(axis=1) / half
    peak = 0.5 * np.ptp(trajectory.extrema(), axis=2) / half
    # The rms of a joint at rest is rounding, and may be zero.
    moves = peak.max(axis=0) > 0.0
    crest = peak.max(axis=0)[moves] / rms.max(axis=0)[moves]
    return float(crest.max()) if moves.any() else np.nan


def regressor(trajectory: Trajectory, geometry: Geometry, time: NDArray) -> NDArray:
    """Return the regressor of rigid body and friction at some times.

    Parameters
    ----------
    trajectory : Trajectory
        Excitation of hip and knee.
    geometry : Geometry
        Lengths and gravity.
    time : (n,) array
        Times, s.

    Returns
    -------
    (n, 2, 8) array
        Torque in N·m per unit of each parameter.
    """
    return paper_model().regressor(_planned(trajectory, geometry, time))


def _planned(
    trajectory: Trajectory, geometry: Geometry, time: NDArray, sample_rate_hz: float = 200.0
) -> Motion:
    q, dq, ddq = trajectory.at(time)
    nothing, segment = np.zeros_like(q), np.zeros(len(time), np.int64)
    valid = np.ones(len(time), bool)
    about: dict[str, Any] = {"sample_rate_hz": sample_rate_hz, "geometry": geometry}
    return Motion(time, q, dq, ddq, nothing, segment, valid, load=nothing, **about)


def standard_errors(
    trajectory: Trajectory, noise: NoiseSettings, geometry: Geometry, sample_rate_hz: float
) -> NDArray:
    """Predict the standard errors of a weighted least-squares fit to one recording.

    Torque noise of a joint is stationary, with standard deviation s and correlation exp(-|t| / T).
    With weights 1 / s², information I = sum of A_j'A_j / s_j², and R the correlation matrix of the
    noise, the covariance of the fit is I⁻¹ (sum of A_j' R A_j / s_j²) I⁻¹. This is exact (White's
    sandwich), whatever noise the fit assumes. Rows near a joint's reversals are zero in A_j,
    because the fit leaves them out.

    Parameters
    ----------
    trajectory : Trajectory
        Excitation of hip and knee.
    noise : NoiseSettings
        Standard deviations, correlation time and duration.
    geometry : Geometry
        Lengths and gravity.
    sample_rate_hz : float
        Sample rate.

    Returns
    -------
    (8,) array
        In the units of the parameters; infinite if they are not identifiable.
    """
    duration = min(noise.duration_s, trajectory.duration_s)
    time = np.arange(0.0, duration, 1.0 / sample_rate_hz)
    motion = _planned(trajectory, geometry, time, sample_rate_hz)
    weight = away_from_reversals(motion) / np.array([noise.hip_nm, noise.knee_nm])
    A = paper_model().regressor(motion) * weight[:, :, np.newaxis]
    correlated = noise.correlation_s > 0.0
    # Correlation of the noise of adjacent samples.
    rho = np.exp(-1.0 / (sample_rate_hz * noise.correlation_s)) if correlated else 0.0
    # Row k of ``earlier`` is sum over i < k of rho^(k - i) A_i, so that A'RA = A'A + A'earlier +
    # earlier'A.
    earlier = lfilter([0.0, rho], [1.0, -rho], A, axis=0)
    information = np.einsum("njp,njq->pq", A, A)
    cross = np.einsum("njp,njq->pq", A, earlier)
    # The inverse would have fewer than three correct digits.
    if _condition(information) * np.finfo(float).eps > 1e-3:
        return np.full(A.shape[2], np.inf)
    inverse = np.linalg.inv(information)
    return np.sqrt(np.diag(inverse @ (information + cross + cross.T) @ inverse))


def paper_model() -> Model:
    """Return the model of an excitation: rigid body, and friction of both joints."""
    return Model.of(baseline(THE_LEG, ("exo_alone",)))


def _parameters() -> dict[str, str]:
    """Return the unit of each column's parameter by its name: ``X1``, ``hip_coulomb``."""
    return {
        f"{effect.joint}_{parameter.name}" if effect.joint else parameter.name: parameter.unit
        for effect, parameter in paper_model().linear_parameters
    }


def _condition(A: NDArray) -> float:
    largest, *_, least = np.linalg.svd(A, compute_uv=False)
    return float(largest / least) if least > 0.0 else np.inf
