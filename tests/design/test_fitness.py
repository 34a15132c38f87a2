"""The compiled fitness against the reference: equations, criteria, bounds between samples."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.design.fitness import (
    Criterion,
    cost,
    expand,
    fill_columns,
    gram_matrix,
    move,
    problem,
    repair,
    workspace,
)
from pipelines.design.quality import quality, regressor
from pipelines.design.search import basis_of, spread_of
from pipelines.design.sines import sines
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import bounds_array
from pipelines.settings.design import DesignSettings, JointBounds

OMEGA = 0.2 * np.pi


def a_problem(harmonics=5, criterion="condition", theta0=None, samples=1000, rest=False):
    return problem(
        omega=OMEGA,
        harmonics=harmonics,
        bounds=bounds_array(JointBounds()),
        geometry=Geometry(),
        criterion=criterion,
        theta0=theta0,
        basis=basis_of(harmonics, rest),
        samples=samples,
    )


def random_candidate(of, seed, size=1.0):
    spread = spread_of(of)
    return size * np.random.default_rng(seed).standard_normal(len(spread)) * spread


def as_trajectory(candidate, of):
    coefficients = np.empty((2, 2, len(of.speeds)))
    expand(candidate, of, coefficients)
    theta0 = candidate[-2:] if of.theta0_is_free else of.theta0
    return FourierTrajectory(theta0.copy(), coefficients[0], coefficients[1], OMEGA)


def test_sine_and_cosine_are_exact_for_any_angle_of_a_joint():
    x = np.linspace(-3 * np.pi, 3 * np.pi, 100_001)
    sine, cosine = np.empty_like(x), np.empty_like(x)
    sines(x, sine, cosine)
    assert_allclose(sine, np.sin(x), atol=1e-14)
    assert_allclose(cosine, np.cos(x), atol=1e-14)


def test_the_compiled_columns_are_the_model_s_regressor():
    of = a_problem()
    candidate, work = random_candidate(of, 1), workspace(of)
    expand(candidate, of, work.coefficients)
    move(of, work)
    repair(candidate, of, work)
    fill_columns(of, work)
    A = regressor(as_trajectory(candidate, of), Geometry(), np.arange(1000) * 0.01)
    assert_allclose(work.columns[:6].T, A[:, 0, :6], atol=1e-9)
    assert_allclose(work.columns[6:].T, A[:, 1, [1, 2, 6, 7]], atol=1e-9)
    assert not A[:, 0, 6:].any() and not A[:, 1, [0, 3, 4, 5]].any()
    stacked = A.reshape(-1, 8)
    assert_allclose(gram_matrix(work.columns), stacked.T @ stacked / 1000, atol=1e-10)


@pytest.mark.parametrize("criterion", Criterion.__members__)
def test_the_fitness_agrees_with_singular_values(criterion):
    for seed in range(10):
        for harmonics, theta0 in ((2, np.array([0.611, -0.925])), (5, None)):
            of = a_problem(harmonics, criterion, theta0)
            candidate = random_candidate(of, seed)
            found = cost(candidate, of, workspace(of))
            reference = quality(as_trajectory(candidate, of), DesignSettings(), Geometry()).value(
                criterion
            )
            assert (-found if criterion == "log_det" else found) == pytest.approx(
                reference, rel=1e-6
            )


@pytest.mark.parametrize("rest", [False, True])
@pytest.mark.parametrize("theta0", [None, np.array([0.611, -0.925])], ids=["free", "fixed"])
@pytest.mark.parametrize("harmonics", [2, 5, 11, 20])
@pytest.mark.parametrize("samples", [200, 1000])
def test_a_repaired_motion_keeps_its_bounds_between_samples(samples, harmonics, theta0, rest):
    of = a_problem(harmonics, "log_det", theta0, max(samples, 40 * harmonics), rest)
    bounds = bounds_array(JointBounds())
    for seed in range(3):
        candidate = random_candidate(of, seed, size=3.0)
        cost(candidate, of, workspace(of))
        motion = as_trajectory(candidate, of)
        fine = np.array(motion.at(np.linspace(0.0, 10.0, 100 * samples)))
        assert np.all(fine.min(axis=1) >= bounds[..., 0] - 1e-12)
        assert np.all(fine.max(axis=1) <= bounds[..., 1] + 1e-12)
        reached = motion.extrema()
        assert np.all(reached[..., 0] >= bounds[..., 0] - 1e-12)
        assert np.all(reached[..., 1] <= bounds[..., 1] + 1e-12)


def test_repair_gives_away_less_than_the_grid_cannot_see():
    of = a_problem(5, "log_det", np.array([0.611, -0.925]))
    for seed in range(20):
        candidate = random_candidate(of, seed, size=3.0)
        cost(candidate, of, workspace(of))
        reached, bounds = as_trajectory(candidate, of).extrema(), bounds_array(JointBounds())
        nearest = np.min(
            np.abs(reached - bounds) / np.ptp(bounds, axis=-1)[..., np.newaxis], axis=(0, 2)
        )
        assert np.all(nearest < 5e-4)  # some bound of each joint is all but touched


def test_a_motion_that_fits_is_left_as_it_is():
    of = a_problem(5, "log_det")
    candidate = random_candidate(of, 0, size=0.01)
    candidate[-2:] = 0.6, -0.9
    before = candidate.copy()
    cost(candidate, of, workspace(of))
    assert_allclose(candidate, before, rtol=0, atol=0)


def test_standing_still_is_the_worst_of_all():
    of = a_problem(5, "scaled_condition")
    still = np.zeros(22)
    still[-2:] = 0.6, -0.9
    assert cost(still, of, workspace(of)) == np.inf
