"""The compiled adaptive loop against the same equations written down once more, for scipy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.mobility import masses, substeps_for
from pipelines.dynamics.rbf_loop import Encoder, RbfController, follow_with_rbf
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.mass_off_axis import MassOffAxis
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.model import Model, Term
from tests.mechanics.equations import coriolis_matrix, gravity_torque

X = np.array([10.3016, 3.0157, 2.2664, 5.5354])
GEOMETRY = Geometry()
IDEAL = Encoder(np.zeros((0, 2)), 0.0, 1.0)
PERIOD = 1e-3


def body(*more: Term, coulomb=0.0) -> Model:
    friction = (Term(Friction(joint), np.array([coulomb, 5.0])) for joint in ("hip", "knee"))
    return Model((Term(RigidBody(), X), *friction, *more))


def controller(**changes) -> RbfController:
    return RbfController(10.0, 200.0, 500.0, 0.0, 1e4, np.linspace(-1.5, 1.5, 7), 10.0)._replace(
        **changes
    )


def wave(t):
    """Angle, velocity and acceleration, (3, 2) at one time."""
    return np.array(
        [
            f(2.5 * t + np.array([0.0, 1.0])) * 2.5**k
            for k, f in enumerate(
                (
                    lambda x: 0.4 * np.sin(x) - 0.2,
                    lambda x: 0.4 * np.cos(x),
                    lambda x: -0.4 * np.sin(x),
                )
            )
        ]
    )


def follow(model: Model, c: RbfController, seconds=2.0, encoder=IDEAL, substeps=1, push_nm=2.0):
    half_steps = np.arange(2 * round(seconds / PERIOD) * substeps + 1) * PERIOD / (2 * substeps)
    reference = np.array([wave(t) for t in half_steps])
    push = np.outer(push_nm * np.sin(2 * half_steps), [1, 1])
    return follow_with_rbf(
        assemble(model, GEOMETRY), c, encoder, reference, push, PERIOD, np.zeros(2), substeps
    )


def by_scipy(c: RbfController, seconds: float):
    """The smooth loop in plain NumPy, integrated to 1e-10."""

    def parts(t, state):
        q, dq, W = state[:2], state[2:4], state[4:].reshape(2, -1)
        qd, dqd, ddqd = wave(t)
        e, de = qd - q, dqd - dq
        r = de + c.error_gain * e
        inputs = np.stack([e, de, qd, dqd, ddqd], axis=1)
        H = np.exp(
            -((inputs[:, np.newaxis] - c.nodes[:, np.newaxis]) ** 2).sum(axis=2) / c.width**2
        )
        return q, dq, r, H, (W * H).sum(axis=1) + c.feedback_gain * r

    def rates(t, state):
        q, dq, r, H, torque = parts(t, state)
        rest = (
            coriolis_matrix(LEG, q, dq, X, GEOMETRY) @ dq
            + gravity_torque(LEG, q, X, GEOMETRY)
            + 5.0 * dq
        )
        ddq = np.linalg.solve(LEG.mass_matrix(q, X, GEOMETRY), torque - 2 * np.sin(2 * t) - rest)
        return np.concatenate([dq, ddq, (c.adaptation_gain * H * r[:, np.newaxis]).ravel()])

    at = np.arange(round(seconds / PERIOD) + 1) * PERIOD
    found = solve_ivp(
        rates, (0, at[-1]), np.zeros(4 + 2 * len(c.nodes)), "DOP853", at, rtol=1e-10, atol=1e-10
    )
    return found.y.T, np.array([parts(t, y)[4] for t, y in zip(at, found.y.T, strict=True)])


def test_the_compiled_loop_integrates_the_equations_of_the_smooth_loop():
    run = follow(body(), controller(), seconds=1.0)
    states, torque = by_scipy(controller(), 1.0)
    assert_allclose(run.angle, states[:, :2], atol=1e-7)
    assert_allclose(run.speed, states[:, 2:4], atol=1e-6)
    assert_allclose(run.torque, torque, atol=1e-3)


def test_adaptation_pauses_while_the_torque_is_at_its_limit():
    run = follow(body(coulomb=3.0), controller(limit=60.0, robust_gain=0.3))
    saturated = np.abs(run.torque) == 60.0
    from_the_start = np.argmin(saturated[:, 0])
    assert from_the_start > 20
    # No weight has been learnt yet, so the network says nothing.
    assert np.all(run.network[:from_the_start, 0] == 0.0)
    assert np.abs(run.network[-1, 0]) > 0.1


def test_torque_never_exceeds_its_limit():
    assert np.abs(follow(body(coulomb=3.0), controller(limit=60.0)).torque).max() == 60.0


def test_an_encoders_offset_is_followed_as_if_it_were_the_angle():
    plain = follow(body(), controller())
    offset = follow(body(Term(EncoderOffset("hip"), np.array([0.05]))), controller())
    lag = (plain.angle - offset.angle)[-500:, 0]
    assert_allclose(lag, 0.05, atol=0.01)


def test_encoder_counts_cost_torque_ripple_and_hardly_any_accuracy():
    n = round(2.0 / PERIOD) + 1
    coarse = Encoder(np.zeros((n, 2)), 2 * np.pi / 20000, 0.5)
    seen, ideal = follow(body(), controller(), encoder=coarse), follow(body(), controller())
    assert np.abs(seen.angle - ideal.angle)[-500:].max() < 0.005
    ripple = [np.abs(np.diff(run.torque[-500:], 2, axis=0)).mean() for run in (seen, ideal)]
    assert ripple[0] > 20 * ripple[1]


def test_an_elastic_knee_is_followed_where_the_step_is_as_short_as_its_motor_needs():
    model = body(Term(JointElasticity("knee"), np.array([2000.0])))
    needed = substeps_for(assemble(model, GEOMETRY), 200.0, PERIOD)
    assert needed > 1
    run = follow(model, controller(), substeps=needed)
    wanted = np.array([wave(k * PERIOD)[0] for k in range(len(run.angle))])
    assert np.abs(run.angle - wanted)[-1000:].max() < 0.05


def test_a_leg_that_hardly_has_mass_at_some_pose_is_refused_before_the_memory_is_full():
    # With the knee folded the mass matrix has the determinant X1 X2 - X2² - (X3 L1)².
    X3 = np.sqrt(X[1] * (X[0] - X[1])) / GEOMETRY.thigh_length_m * (1.0 - 1e-7)
    light = Model((Term(RigidBody(), np.array([X[0], X[1], X3, X[3]])), *body().terms[1:]))
    assert np.all(np.linalg.eigvalsh(masses(assemble(light, GEOMETRY))[0]) > 0.0)
    with pytest.raises(InputError, match="the effective inertia falls to"):
        substeps_for(assemble(light, GEOMETRY), 300.0, PERIOD)


def test_mobility_is_the_inverse_of_the_mass_where_joints_are_rigid():
    mass, mobility = masses(assemble(body(), GEOMETRY))
    assert_allclose(mass @ mobility, np.broadcast_to(np.eye(2), mass.shape), atol=1e-12)
    straight = mass[len(mass) // 2]
    assert_allclose(straight, LEG.mass_matrix(np.zeros(2), X, GEOMETRY))


def test_a_mass_off_the_shanks_axis_is_seen_at_either_bend_of_the_knee():
    either_way = masses(assemble(body(), GEOMETRY))[0]
    assert_allclose(either_way, either_way[::-1], atol=1e-9)
    off_axis = Term(MassOffAxis("knee"), np.array([0.3]))
    mass = masses(assemble(body(off_axis), GEOMETRY))[0]
    assert np.abs(mass - mass[::-1]).max() > 0.1


@pytest.mark.parametrize("substeps", [2, 4])
def test_more_integration_steps_change_nothing_that_matters(substeps):
    rough = controller(robust_gain=0.3, limit=200.0)
    once, often = (
        follow(body(coulomb=3.0), rough),
        follow(body(coulomb=3.0), rough, substeps=substeps),
    )
    assert_allclose(once.angle, often.angle, atol=2e-4)


def test_a_loop_that_runs_away_ends_where_it_left_one_turn():
    run = follow(body(), controller(limit=200.0), seconds=6.0, push_nm=600.0)
    assert 100 < len(run.angle) < 6001
    assert not np.all(np.abs(run.angle[-1]) < 2 * np.pi)
    assert np.all(np.abs(run.angle[:-1]) < 2 * np.pi)
