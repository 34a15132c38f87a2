"""A rotor that the moving thigh carries, against a plant written by hand from its energy."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import DQ, Q, resting_state, stages, step, workspace
from pipelines.effects.baseline import RigidBody
from pipelines.effects.rotor_coupling import RotorCoupling
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.mechanics.geometry import Geometry
from pipelines.model import Model, Term

LENGTH, GRAVITY = 0.4, 9.81
X1, X2, X3, X4 = 0.30, 0.08, 0.25, 0.9
ROTOR, RATIO = 0.0007, -6.0
"""kg·m² at the motor; a planetary gear that reverses."""


def drive(t):
    return np.array([1.5 * np.sin(3.0 * t), 0.8 * np.cos(5.0 * t)])


def by_hand(t, state):
    """Lagrange's equations of two links and the rotor's (dq1 + N dq2)², solved for the
    accelerations."""
    (q1, q2), (v1, v2) = state[:2], state[2:]
    bend, h = X3 * LENGTH * np.cos(q2), X3 * LENGTH * np.sin(q2)
    links = np.array([[X1 + 2 * bend, X2 + bend], [X2 + bend, X2]])
    rotor = ROTOR * np.outer([1.0, RATIO], [1.0, RATIO])
    velocity = np.array([-h * v2 * (2 * v1 + v2), h * v1**2])
    weight = GRAVITY * np.array([X3 * np.sin(q1 + q2) + X4 * np.sin(q1), X3 * np.sin(q1 + q2)])
    return np.concatenate([state[2:], np.linalg.solve(links + rotor, drive(t) - velocity - weight)])


def model(own_inertia, coupling, body=(X1 + ROTOR, X2, X3, X4)):
    terms = [Term(RigidBody(), np.array(body)), Term(RotorInertia("knee"), np.array([own_inertia]))]
    return Model((*terms, Term(RotorCoupling("knee"), np.array([coupling]))))


def simulated(of, seconds=2.0, h=2e-4):
    a = assemble(of, Geometry(LENGTH, GRAVITY))
    w, s, state, load = (
        workspace(2),
        stages(2, 0),
        resting_state(np.array([0.6, -0.9])),
        np.zeros(2),
    )
    for i in range(round(seconds / h)):
        step(a, w, s, i * h, h, state, np.zeros(0), load, drive((i + 0.5) * h))
    return np.concatenate([state[Q], state[DQ]])


def test_a_leg_with_a_carried_rotor_moves_as_its_energy_says():
    truth = solve_ivp(by_hand, (0, 2), [0.6, -0.9, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    found = simulated(model(RATIO**2 * ROTOR, RATIO * ROTOR))
    assert_allclose(found, truth, atol=1e-5)
    without = simulated(model(RATIO**2 * ROTOR, 0.0))
    assert np.abs(without - truth).max() > 0.01


def test_no_motion_separates_the_coupling_from_x2_and_the_rotors_own_inertia(with_human):
    c = RATIO * ROTOR
    apart = model(RATIO**2 * ROTOR, c).torque(with_human)
    taken_up = model(RATIO**2 * ROTOR - c, 0.0, (X1 + ROTOR, X2 + c, X3, X4)).torque(with_human)
    assert_allclose(apart, taken_up, atol=1e-12)
    assert not RotorCoupling.possible(RotorCoupling("knee").on)
