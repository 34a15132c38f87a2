"""The paper's slips in modelling and excitation: the printed form fails, the mended one holds
(docs/errata.md)."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG, regressor_at
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings import datasets
from tests.mechanics.equations import coriolis_matrix, gravity_torque, potential_energy

GEOMETRY = Geometry()
LENGTH, GRAVITY = GEOMETRY.thigh_length_m, GEOMETRY.gravity_m_s2
X1, X2, X3, X4 = TABLE3 = np.array([10.3016, 3.0157, 2.2664, 5.5354])
FRICTION = np.array([2.6596, 4.14895, 4.7197, 7.3602])
ANGLE, SPEED, ACCELERATION = (0.0872, 1.2217), 1.6449, 5.1677
"""Table 2: the hip's angles, and both joints' speed and acceleration."""


@pytest.fixture
def published() -> FourierTrajectory:
    return read_trajectory(datasets() / "paper" / "trajectory.toml")


def printed_gravity(q):
    """G as printed: the thigh's part at the knee angle."""
    shank = X3 * GRAVITY * np.sin(q[0] + q[1])
    return np.array([shank + X4 * GRAVITY * np.sin(q[1]), shank])


def printed_coriolis(q, dq):
    h = X3 * LENGTH * np.sin(q[1])
    return np.array([[-2 * h * dq[1], -h * dq[1]], [h * dq[0], 0.0]])


def energy_drift(gravity):
    """Largest change of energy in a free swing of 3 s, and how much energy swings, J."""

    def rates(_, state):
        q, dq = state[:2], state[2:]
        ddq = np.linalg.solve(
            LEG.mass_matrix(q, TABLE3, GEOMETRY),
            -coriolis_matrix(LEG, q, dq, TABLE3, GEOMETRY) @ dq - gravity(q),
        )
        return np.concatenate([dq, ddq])

    states = solve_ivp(rates, (0, 3), [1.2, -0.8, 0, 0], rtol=1e-9, atol=1e-9, max_step=0.02).y.T
    kinetic = np.array(
        [0.5 * s[2:] @ LEG.mass_matrix(s[:2], TABLE3, GEOMETRY) @ s[2:] for s in states]
    )
    energy = kinetic + [potential_energy(s[:2], TABLE3, GEOMETRY) for s in states]
    return np.ptp(energy), potential_energy(states[0, :2], TABLE3, GEOMETRY) - potential_energy(
        [0, 0], TABLE3, GEOMETRY
    )


def test_a_free_swing_keeps_its_energy_with_the_thighs_gravity_at_the_hip_angle_only():
    drift, swing = energy_drift(lambda q: gravity_torque(LEG, q, TABLE3, GEOMETRY))
    assert drift < 1e-4 * swing
    drift, swing = energy_drift(printed_gravity)
    assert drift > swing


def test_the_hips_inertia_holds_the_shanks_centre_at_the_shanks_mass(segments):
    # The whole straight leg turns about the hip: its energy is M11 dq1² / 2.
    M11 = 2 * segments.kinetic(np.zeros(2), np.array([1.0, 0.0]))
    coupling = 2 * segments.X[2] * LENGTH
    printed = segments.X[0] - segments.m2 * segments.c2**2 + segments.m1 * segments.c2**2
    assert segments.X[0] + coupling == pytest.approx(M11)
    assert abs(printed + coupling - M11) > 0.1


def test_the_printed_coriolis_matrix_is_not_the_one_that_takes_no_energy(states):
    worst = 0.0
    for q, dq, _ in states:
        mended = coriolis_matrix(LEG, q, dq, TABLE3, GEOMETRY)
        assert_allclose(printed_coriolis(q, dq) @ dq, mended @ dq, atol=1e-12)
        ahead, behind = (
            LEG.mass_matrix(q + sign * 1e-6 * dq, TABLE3, GEOMETRY) for sign in (1, -1)
        )
        rate = (ahead - behind) / 2e-6
        symmetric = [rate - 2 * C + (rate - 2 * C).T for C in (mended, printed_coriolis(q, dq))]
        assert np.abs(symmetric[0]).max() < 1e-8
        worst = max(worst, 0.5 * np.abs(symmetric[1]).max())
    assert worst > 1.5  # N·m·s/rad: the stability proof rests on zero


def test_lagranges_equation_needs_the_total_derivative_of_time(segments, states):
    for q, dq, ddq in states:
        mended = (
            np.array(regressor_at(q.copy(), dq.copy(), ddq.copy(), LENGTH, GRAVITY)) @ segments.X
        )
        assert_allclose(segments.torque(q, dq, ddq), mended, atol=1e-4)
        # The momentum does not name time, so its partial derivative is zero and only -dL/dq is
        # left.
        assert np.abs(-segments.force(q, dq) - mended).max() > 1e-3


def test_a_harmonic_of_order_zero_would_have_no_sine_and_move_the_mean(published):
    one_period = np.arange(1000) * published.period_s / 1000
    assert_allclose(published.at(one_period)[0].mean(axis=0), published.theta0, atol=1e-12)
    k, a0, b0 = 0, 0.3, 0.2
    printed = a0 * np.sin(k * published.omega * one_period) + b0 * np.cos(
        k * published.omega * one_period
    )
    assert_allclose(printed, b0)


def test_no_motion_satisfies_the_printed_bounds_and_the_published_one_keeps_table_2(published):
    q, dq, ddq = published.at(np.linspace(0, published.period_s, 2000))
    printed = (
        (q[:, 1] > 1.6232)
        & (q[:, 1] < -0.2269)
        & (np.abs(dq) > SPEED).all(1)
        & (np.abs(dq) < SPEED).all(1)
    )
    assert not printed.any()
    assert q[:, 0].min() > ANGLE[0] and q[:, 0].max() < ANGLE[1]
    assert q[:, 1].min() > -1.6232 and q[:, 1].max() < -0.2269
    assert np.abs(dq).max() < SPEED and np.abs(ddq).max() < ACCELERATION


def test_the_published_coefficients_are_degrees(published):
    in_radians = replace(published, a=np.degrees(published.a), b=np.degrees(published.b))
    assert np.ptp(in_radians.at(np.linspace(0, 10, 500))[0], axis=0).min() > 2 * np.pi
    assert np.ptp(published.at(np.linspace(0, 10, 500))[0], axis=0).max() < 1.4


def test_row_two_of_the_regressor_has_eight_columns_of_which_the_last_is_the_knees_viscous_friction(
    states,
):
    for q, dq, ddq in states:
        _, knee = regressor_at(q.copy(), dq.copy(), ddq.copy(), LENGTH, GRAVITY)
        A21, A22, A23, A24 = knee
        A25 = A26 = 0.0
        A27, A28 = np.sign(dq[1]), dq[1]
        parameters = np.append(TABLE3, FRICTION)
        torque = (
            LEG.mass_matrix(q, TABLE3, GEOMETRY) @ ddq
            + coriolis_matrix(LEG, q, dq, TABLE3, GEOMETRY) @ dq
        )
        torque = torque + gravity_torque(LEG, q, TABLE3, GEOMETRY)
        knee_torque = torque[1] + FRICTION[2] * np.sign(dq[1]) + FRICTION[3] * dq[1]
        mended = np.array([A21, A22, A23, A24, A25, A26, A27, A28])
        printed = np.array([A21, A21, A22, A23, A24, A25, A26, A27])
        assert mended @ parameters == pytest.approx(knee_torque)
        assert abs(printed @ parameters - knee_torque) > 1e-3
        assert A21 == A24 == 0.0


def test_equation_2_is_an_energy_and_cannot_be_compared_with_a_torque(segments, states):
    energies = [segments.kinetic(q, dq) for q, dq, _ in states]
    torques = [
        np.array(regressor_at(*(x.copy() for x in s), LENGTH, GRAVITY)) @ segments.X for s in states
    ]
    assert min(energies) >= 0 and np.min(torques) < 0 < np.max(torques)
