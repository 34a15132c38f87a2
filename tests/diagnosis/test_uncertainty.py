"""Noise averages out over more periods; what the model gets wrong is the same again in each."""

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.fit.joint_fit import fit
from pipelines.diagnosis.fit.uncertainty import Uncertainty, _shapes, uncertainty
from pipelines.effects import ParallelSpring
from pipelines.effects.position_dependent_friction import PositionDependentFriction
from tests.diagnosis.sessions import session

NOISE = np.array([0.3, 0.2])
"""N·m."""


def error_of_stiffness(seconds: float, imperfect: float) -> float:
    """Return the standard error of a spring at the knee after periods of 10 s, N·m/rad."""
    motions = session(
        "parallel_spring", "knee", seed=4, seconds=seconds, stiffness=10.0, rest_angle=-0.9
    )
    runs = [observe(motion) for motion in motions if motion.purpose == "train"]
    baseline = baseline_of(runs)
    effect = ParallelSpring("knee", on=baseline.machine)
    weights = np.append(NOISE**-2.0, np.zeros(runs[0].measured.shape[1] - 2))
    fitted = fit([Candidate(effect, ((),) * len(runs))], runs, baseline, weights)
    known = uncertainty(fitted, runs, baseline, np.full(len(weights), imperfect))
    place = fitted.columns_of(0).places(0)[0]
    return float(np.sqrt(known.covariance[place, place]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("imperfect", "ratio"), [pytest.param(0.0, 0.5, marks=pytest.mark.slow), (3.0, 1.0)]
)
def test_four_times_as_many_periods_halve_what_noise_leaves_in_doubt_and_no_misfit(
    imperfect, ratio
):
    assert error_of_stiffness(80.0, imperfect) / error_of_stiffness(
        20.0, imperfect
    ) == pytest.approx(ratio, rel=0.2)


@pytest.mark.parametrize("critical", [1.96, 2.6])
def test_a_joint_region_includes_zero_95_times_in_100_where_the_truth_is_zero(critical):
    """Two correlated amplitudes; few independent samples, a larger ``critical``, make it wider by
    as much."""
    covariance = np.array([[4.0, 1.9, 0.0], [1.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    known = Uncertainty((1.96 / critical) ** 2 * covariance, critical, (), np.eye(3))
    values = np.random.default_rng(5).multivariate_normal(np.zeros(3), covariance, 2000)
    share = np.mean([known.includes_zero(one, slice(0, 2)) for one in values])
    assert share == pytest.approx(0.95, abs=0.012)
    assert not known.includes_zero(np.array([0.0, 0.0, 9.0]), slice(2, 3))
    assert not known.includes_zero(values[0], slice(1, 1))


def test_ends_of_the_motion_are_known_and_widen_no_interval():
    effect = PositionDependentFriction("knee")
    cause = Candidate(effect, ((-1.4, -0.5),))
    assert _shapes([cause], 1, fitted=False) == _shapes([cause], 1, fitted=True) == []
