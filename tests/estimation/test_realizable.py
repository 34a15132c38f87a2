"""The realizable fit has the least residual among models that can exist."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from pipelines.estimation.estimator import estimated
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.problem import Problem, Training
from pipelines.estimation.realizable import Realizable, nearest
from pipelines.identification import identify
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import MECHANISMS
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.run import Run
from pipelines.model import Model, baseline

L1 = Geometry().thigh_length_m


def swing(X, friction=(2.0, 3.0, 2.0, 3.0), kind="exo_alone", purpose="train", seed=0):
    """A motion of 20 s whose torque is that of parameters that need not be realizable, with white
    noise."""
    t = np.arange(4000) / 200.0
    waves = (
        [(0.35, 1.3, 0.0, 0.7), (0.15, 3.1, 1.0, 0.0)],
        [(0.4, 1.9, 1.0, -0.9), (0.2, 4.3, 0.3, 0.0)],
    )
    q, dq, ddq = (
        np.column_stack([sum(f(*wave) for wave in joint) for joint in waves])
        for f in (
            lambda a, w, p, mean: mean + a * np.sin(w * t + p),
            lambda a, w, p, mean: a * w * np.cos(w * t + p),
            lambda a, w, p, mean: -a * w**2 * np.sin(w * t + p),
        )
    )
    ones, noise = (
        np.ones(len(t), dtype=bool),
        np.random.default_rng(seed).normal(0.0, [0.5, 0.3], q.shape),
    )
    bare = Motion(
        t,
        q,
        dq,
        ddq,
        np.zeros_like(q),
        np.zeros(len(t), dtype=np.int64),
        ones,
        run=kind,
        purpose=purpose,
    )
    ks, km = np.array(friction).reshape(2, 2).T
    torque = LEG.regressor(q, dq, ddq, bare.geometry) @ X + ks * np.sign(dq) + km * dq + noise
    return replace(bare, torque=torque, file=f"{kind}_{purpose}.parquet")


def problem_of(run: Run):
    model = Model.of(baseline(run.machine, ["exo_alone"]))
    return Problem(Training((run,), model), ("exo_alone",), np.arange(8), np.zeros(8))


def slack(X):
    """Above 0 where M(q) > 0 at every angle."""
    return X[1] * (X[0] - X[1]) - (L1 * X[2]) ** 2


UNREAL = {
    "mass matrix": (np.array([1.0, 0.5, 1.6, 2.3]), (2.0, 3.0, 2.0, 3.0)),
    "shank of no inertia": (np.array([1.0, -0.2, 0.1, 2.3]), (2.0, 3.0, 2.0, 3.0)),
    "friction that gives energy": (np.array([1.0, 0.22, 0.55, 2.3]), (2.0, -0.5, 2.0, 3.0)),
}


@pytest.mark.parametrize(("X", "friction"), UNREAL.values(), ids=UNREAL)
def test_the_realizable_fit_of_unreal_data_is_the_nearest_on_the_boundary_by_brute_force(
    X, friction
):
    problem = problem_of(swing(X, friction))
    free, fit = WeightedLeastSquares().fit(problem), Realizable().fit(problem)
    assert LEG.unrealizable(free.values[:4], Geometry()) or free.values[5] < 0.0
    assert not LEG.unrealizable(fit.values[:4], Geometry())
    assert np.all(fit.values[4:] > -1e-6)
    on_boundary = [
        slack(fit.values) / np.trace(np.diag(fit.values[:2])) ** 2,
        np.min(fit.values[4:]),
    ]
    assert min(np.abs(on_boundary)) < 1e-5
    assert (
        fit.about["constrained"]
        and "least squares alone gives a machine that cannot exist" in fit.remarks[0]
    )

    def rise(values):
        away = values - free.values
        return away @ free.normal @ away

    best = rise(fit.values)
    assert best > 1.0
    # Brute force: realizable values all around, then the best of many searches that know no
    # convexity.
    rng, size = np.random.default_rng(0), np.sqrt(np.diag(free.sensitivity))
    for scale in 10.0 ** np.linspace(-4.0, 1.0, 2000):
        trial = fit.values + scale * size * rng.standard_normal(8)
        if not LEG.unrealizable(trial[:4], Geometry()) and np.all(trial[4:] >= 0.0):
            assert rise(trial) > best * (1.0 - 1e-4), (
                "no nearer than what the margin of the boundary makes"
            )
    conditions = [
        {"type": "ineq", "fun": f}
        for f in (slack, lambda v: v[1], lambda v: v[0] - v[1], lambda v: v[4:])
    ]
    searched = [
        minimize(
            lambda v: rise(v) / best,
            start,
            constraints=conditions,
            method="SLSQP",
            options={"maxiter": 500},
        )
        for start in (
            [1.0, 0.3, 0.4, 2.0, 2.0, 3.0, 2.0, 3.0],
            [3.0, 1.0, 1.0, 4.0, 1.0, 1.0, 1.0, 1.0],
        )
    ]
    assert min(found.fun for found in searched if found.success) == pytest.approx(1.0, rel=1e-3)


def test_a_fit_that_can_exist_is_left_as_it_is():
    problem = problem_of(swing(np.array([1.0, 0.22, 0.55, 2.3])))
    free, fit = WeightedLeastSquares().fit(problem), Realizable().fit(problem)
    assert_allclose(fit.values, free.values, rtol=1e-9)
    assert not fit.about["constrained"] and not fit.remarks


def test_the_wearer_is_made_realizable_too():
    """With the human the whole is real, but less than the machine alone: the difference is nobody's
    leg."""
    exo, whole = np.array([1.0, 0.22, 0.55, 2.3]), np.array([0.8, 0.18, 0.45, 2.6])
    runs = [
        swing(X, kind=kind, purpose=purpose, seed=seed)
        for seed, (kind, X) in enumerate((("exo_alone", exo), ("with_human", whole)))
        for purpose in ("train", "validate")
    ]
    free, real = identify(runs), identify(runs, Realizable())
    assert any(sentence.startswith("human: ") for sentence in free.unrealizable)
    assert real.unrealizable == []
    assert any(remark.startswith("with_human: least squares alone") for remark in real.remarks)


def test_intervals_cover_a_truth_on_the_boundary():
    """The worst place there is: half of all fits are pushed back."""
    truth = np.array([1.2, 0.3, np.sqrt(0.3 * 0.9 * 0.999) / L1, 2.3, 2.0, 3.0, 2.0, 3.0])
    assert slack(truth) > 0.0
    inside, pushed = [], 0
    clean = swing(truth[:4], seed=0)
    for seed in range(100):
        noise = np.random.default_rng(seed).normal(0.0, [0.5, 0.3], clean.torque.shape)
        found = estimated(Realizable().fit(problem_of(replace(clean, torque=clean.torque + noise))))
        pushed += found.about["constrained"]
        half = found.critical * np.sqrt(np.diag(found.covariance))
        inside.append(np.abs(found.values - truth) <= half)
    print(f"\npushed back {pushed} of 100, covered {np.mean(inside):.3f}")
    assert 20 < pushed < 80
    assert np.mean(inside) > 0.93


@pytest.mark.parametrize(
    "mechanism", MECHANISMS, ids=lambda m: f"{m.name}-{m.kinds[0]}-{m.has_gravity}"
)
def test_the_inertia_form_is_definite_exactly_where_the_mass_matrix_is(mechanism):
    rng, geometry = (
        np.random.default_rng(1),
        Geometry(gravity_m_s2=0.0 if mechanism.has_gravity is False else 9.8),
    )
    forms = mechanism.inertia_forms(geometry)
    agreed = 0
    for _ in range(100):
        X = rng.normal([1.0, 0.4, 0.5, 2.0][: len(mechanism.parameters)], 0.6)
        definite = np.linalg.eigvalsh(np.einsum("p,pmn->mn", X, forms))[0] > 0.0
        turns = [np.full(len(mechanism.kinds), angle) for angle in np.linspace(0.0, np.pi, 31)]
        lightest = min(np.linalg.eigvalsh(mechanism.mass_matrix(q, X, geometry))[0] for q in turns)
        # The angles are a grid: a matrix may be definite on all of it and just not so between.
        assert definite == (lightest > 0.0) or abs(lightest) < 1e-3
        assert definite == (not mechanism.unrealizable(X, geometry))
        agreed += definite
    assert 10 < agreed < 98


def test_the_nearest_realizable_model_to_one_that_is_is_itself():
    problem = problem_of(swing(np.array([1.0, 0.22, 0.55, 2.3])))
    values = np.array([1.0, 0.22, 0.55, 2.3, 2.0, 3.0, 2.0, 3.0])
    assert_allclose(nearest(problem, values, np.eye(8)), values, rtol=1e-6)
