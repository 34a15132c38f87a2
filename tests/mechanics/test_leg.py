"""What the leg's equations must keep to, whatever its parameters."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG, cuff_torque
from tests.mechanics.equations import coriolis_matrix, gravity_torque, potential_energy

GEOMETRY = Geometry()
TABLE3 = np.array([10.3016, 3.0157, 2.2664, 5.5354])
LENGTH, GRAVITY = GEOMETRY.thigh_length_m, GEOMETRY.gravity_m_s2


def test_regressor_times_parameters_is_the_torque_of_lagrange(segments, states):
    q, dq, ddq = (np.ascontiguousarray(states[:, i]) for i in range(3))
    torque = LEG.regressor(q, dq, ddq, GEOMETRY) @ segments.X
    assert_allclose(torque, [segments.torque(*state) for state in states], atol=1e-4)


def test_mass_coriolis_and_gravity_add_up_to_the_regressor(states):
    for q, dq, ddq in states:
        parts = (
            LEG.mass_matrix(q, TABLE3, GEOMETRY) @ ddq
            + coriolis_matrix(LEG, q, dq, TABLE3, GEOMETRY) @ dq
        )
        whole = LEG.regressor(q[None], dq[None], ddq[None], GEOMETRY)[0] @ TABLE3
        assert_allclose(parts + gravity_torque(LEG, q, TABLE3, GEOMETRY), whole, atol=1e-12)


def test_mass_matrix_is_symmetric_and_positive_definite(segments, states):
    for X in (TABLE3, segments.X):
        for q, _, _ in states:
            M = LEG.mass_matrix(q, X, GEOMETRY)
            assert_allclose(M, M.T, atol=1e-14)
            assert np.linalg.eigvalsh(M).min() > 0


def test_mass_matrix_gives_the_kinetic_energy(segments, states):
    for q, dq, _ in states:
        assert 0.5 * dq @ LEG.mass_matrix(q, segments.X, GEOMETRY) @ dq == pytest.approx(
            segments.kinetic(q, dq)
        )


def test_coriolis_matrix_takes_and_gives_no_energy(states):
    for q, dq, _ in states:
        ahead, behind = (
            LEG.mass_matrix(q + sign * 1e-6 * dq, TABLE3, GEOMETRY) for sign in (1, -1)
        )
        skew = (ahead - behind) / 2e-6 - 2 * coriolis_matrix(LEG, q, dq, TABLE3, GEOMETRY)
        assert_allclose(skew + skew.T, 0, atol=1e-8)


def test_gravity_is_the_slope_of_the_potential(segments, states):
    for q, _, _ in states:
        slope = [
            (
                potential_energy(q + e, segments.X, GEOMETRY)
                - potential_energy(q - e, segments.X, GEOMETRY)
            )
            / 2e-5
            for e in 1e-5 * np.eye(2)
        ]
        assert_allclose(gravity_torque(LEG, q, segments.X, GEOMETRY), slope, atol=1e-7)
        assert potential_energy(q, segments.X, GEOMETRY) == pytest.approx(segments.potential(q))


def test_a_leg_that_hangs_straight_needs_no_torque():
    assert_allclose(gravity_torque(LEG, np.zeros(2), TABLE3, GEOMETRY), 0, atol=1e-14)


def test_realizable_means_a_positive_mass_matrix_at_every_knee_angle():
    draw = np.random.default_rng(2).uniform(0.1, 4.0, (300, 4))
    knees = np.linspace(0, np.pi, 181)
    verdicts = set()
    for X in draw:
        positive = all(
            np.linalg.eigvalsh(LEG.mass_matrix([0, q2], X, GEOMETRY)).min() > 0 for q2 in knees
        )
        assert positive == (LEG.unrealizable(X, GEOMETRY) == [])
        verdicts.add(positive)
    assert verdicts == {True, False}


def test_unrealizable_parameters_are_reported_with_their_numbers():
    assert LEG.unrealizable(np.array([2.0, 1.0, 4.0, 5.0]), GEOMETRY) == [
        "X2 (X1 - X2) = 1 is not above (L1 X3)² = 2.428 kg²·m⁴: the mass matrix is not positive"
        " definite"
    ]
    assert (
        "X2 = -1 kg·m² is not positive"
        in LEG.unrealizable(np.array([2.0, -1.0, 0.1, 5.0]), GEOMETRY)[0]
    )


def test_cuff_torque_is_the_power_of_the_forces_over_the_speeds():
    geometry = Geometry(thigh_cuff_distance_m=0.25, shank_cuff_distance_m=0.2)
    draw = np.random.default_rng(3)
    thigh, shank, q = (
        draw.normal(size=(20, 3)),
        draw.normal(size=(20, 3)),
        draw.uniform(-1.5, 1.5, (20, 2)),
    )

    def places(q1, q2):
        """Thigh and shank cuff, (2, 2) m: forward, up from the hip axis."""
        thigh_end = np.array([np.sin(q1), -np.cos(q1)])
        shank_end = np.array([np.sin(q1 + q2), -np.cos(q1 + q2)])
        return np.array([0.25 * thigh_end, LENGTH * thigh_end + 0.2 * shank_end])

    for f_thigh, f_shank, (q1, q2), found in zip(
        thigh, shank, q, cuff_torque(thigh, shank, q, geometry), strict=True
    ):
        absolute = []
        for (along, forward, _), angle in ((f_thigh, q1), (f_shank, q1 + q2)):
            distal, ahead = (
                np.array([np.sin(angle), -np.cos(angle)]),
                np.array([np.cos(angle), np.sin(angle)]),
            )
            absolute.append(along * distal + forward * ahead)
        for j, step in enumerate(1e-6 * np.eye(2)):
            moved = (
                places(*(np.array([q1, q2]) + step)) - places(*(np.array([q1, q2]) - step))
            ) / 2e-6
            assert found[j] == pytest.approx(np.sum(np.array(absolute) * moved), abs=1e-7)
