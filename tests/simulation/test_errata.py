"""The paper's slips in the controller: the printed form fails, the mended one holds
(docs/errata.md)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.dynamics.tracking import track
from pipelines.mechanics.gait import gait
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.settings.simulate import SimulateSettings
from pipelines.simulation.sweep import sweep
from tests.mechanics.equations import coriolis_matrix, gravity_torque

X = np.array([10.3016, 3.0157, 2.2664, 5.5354])
LAMBDA = 10.0


class Tracking:
    """A moment of a leg under some torque: its reference, its state, and what eq. 13 makes of
    it."""

    def __init__(self, seed, geometry):
        draw = np.random.default_rng(seed)
        self.t = draw.uniform(0, 10)
        self.qd, self.dqd, self.ddqd = (x[0] for x in gait().at(self.t))
        self.q, self.dq = draw.uniform(-1, 1, (2, 2))
        self.torque, self.disturbance, self.friction = draw.uniform(-20, 20, (3, 2))
        self.M = LEG.mass_matrix(self.q, X, geometry)
        self.C = coriolis_matrix(LEG, self.q, self.dq, X, geometry)
        self.G = gravity_torque(LEG, self.q, X, geometry)
        push = self.torque - self.disturbance - self.friction
        self.ddq = np.linalg.solve(self.M, push - self.C @ self.dq - self.G)
        self.e, self.de, self.dde = self.qd - self.q, self.dqd - self.dq, self.ddqd - self.ddq
        self.r, self.dr = self.de + LAMBDA * self.e, self.dde + LAMBDA * self.de


@pytest.fixture
def moments(table3):
    return [Tracking(seed, table3.geometry) for seed in range(20)]


def test_equation_16_holds_as_printed(moments):
    for m in moments:
        assert_allclose(m.dq, -m.r + m.dqd + LAMBDA * m.e, atol=1e-12)


def test_equation_17_needs_the_acceleration(moments):
    for m in moments:
        assert_allclose(m.M @ m.dr, m.M @ (m.ddqd - m.ddq + LAMBDA * m.de), atol=1e-9)
        assert np.abs(m.M @ m.dr - m.M @ (m.ddqd - m.dq + LAMBDA * m.de)).max() > 0.1


def test_equation_19_needs_the_errors_rate_and_the_wanted_speed(moments):
    for m in moments:
        mended = m.M @ (m.ddqd + LAMBDA * m.de) + m.C @ (m.dqd + LAMBDA * m.e) + m.G + m.friction
        printed = m.M @ (m.ddqd + LAMBDA * m.e) + m.C @ (m.qd + LAMBDA * m.e) + m.G + m.friction
        left = m.M @ m.dr  # eq. 18
        assert_allclose(left, -m.C @ m.r - m.torque + mended + m.disturbance, atol=1e-9)
        assert np.abs(left - (-m.C @ m.r - m.torque + printed + m.disturbance)).max() > 0.1


def test_the_networks_inputs_are_the_wanted_angles_not_the_wanted_filtered_error():
    nodes = np.linspace(-1.5, 1.5, 7)

    def activation(wanted):
        # On the reference e = de = 0.
        inputs = np.concatenate([np.zeros((len(wanted), 2)), wanted], axis=1)
        return np.exp(-((inputs[:, np.newaxis] - nodes[:, np.newaxis]) ** 2).sum(axis=2) / 10.0**2)

    angles = np.stack(gait().at(np.linspace(0, 2, 50)), axis=1)[:, :, 0]
    # What is wanted of q = de + Lambda e is zero at all times: such a network could only learn one
    # constant.
    assert np.ptp(activation(np.zeros_like(angles)), axis=0).max() == 0.0
    assert np.ptp(activation(angles), axis=0).max() > 0.1


def test_the_torque_is_network_plus_feedback_not_equal_to_it(table3):
    settings = SimulateSettings()
    with_network = track(table3, settings, gait()).worst_error(5.0)
    without = track(
        table3, settings.model_copy(update={"adaptation_gain": 0.0}), gait()
    ).worst_error(5.0)
    assert np.all(with_network < without)


def test_the_robust_term_needs_the_bound_of_the_disturbance_and_the_1_norm():
    draw = np.random.default_rng(4)
    error_bound, disturbance_bound = 0.1, 0.2
    printed_feeds_energy = False
    for _ in range(200):
        r = draw.normal(size=2)
        error = draw.uniform(-error_bound, error_bound, 2)
        disturbance = draw.uniform(-disturbance_bound, disturbance_bound, 2)
        v = -(error_bound + disturbance_bound) * np.sign(r)
        assert r @ v == pytest.approx(-(error_bound + disturbance_bound) * np.abs(r).sum())
        # So not the 2-norm.
        assert abs(r @ v) > (error_bound + disturbance_bound) * np.linalg.norm(r)
        assert r @ (error + disturbance + v) <= 0
        printed_feeds_energy |= (
            r @ (error + disturbance - (error_bound + disturbance) * np.sign(r)) > 0
        )
    assert printed_feeds_energy


def test_the_adaptive_law_is_that_of_the_estimate():
    draw = np.random.default_rng(5)
    H, r, wrong = draw.normal(size=(7, 1)), draw.normal(size=(2, 1)), draw.normal(size=(7, 2))
    F = 500.0

    def term(rate_of_wrong):
        """The term of eq. 28 that the law has to cancel; ``wrong`` is W less its estimate."""
        return np.trace(wrong.T @ (rate_of_wrong / F + H @ r.T))

    estimates_rate = F * H @ r.T
    assert term(-estimates_rate) == pytest.approx(0.0, abs=1e-9)
    assert abs(term(estimates_rate)) > 0.1


def test_from_300_to_500_the_error_falls_by_less_than_a_hundredth(table3):
    errors = sweep(table3, SimulateSettings(), gait(), (300.0, 500.0))[
        ["hip_error_rad", "knee_error_rad"]
    ].to_numpy()
    assert np.all(errors[0] - errors[1] > 0) and np.all(errors[0] - errors[1] < 0.01)


def test_the_loop_depends_on_time_so_that_lasalles_theorem_says_nothing_of_it(table3):
    def rate_at_rest_on_the_reference(t):
        """M dr where e, de and all weights are zero: the same state of the loop, at different
        times."""
        qd, dqd, ddqd = (x[0] for x in gait().at(t))
        g = table3.geometry
        return (
            LEG.mass_matrix(qd, X, g) @ ddqd
            + coriolis_matrix(LEG, qd, dqd, X, g) @ dqd
            + gravity_torque(LEG, qd, X, g)
        )

    assert (
        np.abs(rate_at_rest_on_the_reference(0.0) - rate_at_rest_on_the_reference(0.7)).max() > 1.0
    )


def test_the_limit_is_reached_where_the_proof_has_none(table3):
    assert np.abs(track(table3, SimulateSettings(), gait()).run.torque).max() == 200.0
