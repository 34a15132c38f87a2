"""Laws that hold whatever the model: energy, standstill, two masses on a spring."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from pipelines.contracts import Joint
from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import (
    DQ,
    DTHETA,
    THETA,
    Q,
    memory_size,
    resting_state,
    stages,
    step,
    workspace,
)
from pipelines.dynamics.mobility import masses
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.presliding_hysteresis import PreslidingHysteresis
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.instant import REACTION
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.model import Model, Term
from tests.mechanics.equations import gravity_torque, potential_energy

X = np.array([2.6, 0.63, 1.78, 5.7])
GEOMETRY = Geometry()
BODY = Term(RigidBody(), X)


def friction(coulomb, viscous):
    return tuple(Term(Friction(joint), np.array([coulomb, viscous])) for joint in ("hip", "knee"))


class Swing:
    """A leg let go at angles ``q`` under constant drive torque."""

    def __init__(self, *terms, q, torque=(0.0, 0.0), h=2e-4):
        self.a = assemble(Model(terms), GEOMETRY)
        self.state = resting_state(np.array(q))
        self.memory = np.zeros(memory_size(self.a))
        self.load = np.zeros(2)
        self.torque = np.array(torque, dtype=float)
        self.scratch = workspace(2), stages(2, len(self.memory))
        self.h, self.t = h, 0.0

    def go(self, seconds):
        for _ in range(round(seconds / self.h)):
            step(
                self.a,
                *self.scratch,
                self.t,
                self.h,
                self.state,
                self.memory,
                self.load,
                self.torque,
            )
            self.t += self.h
        return self


def energy(state):
    return 0.5 * state[DQ] @ LEG.mass_matrix(state[Q], X, GEOMETRY) @ state[DQ] + potential_energy(
        state[Q], X, GEOMETRY
    )


def test_a_free_swing_keeps_its_energy():
    swing = Swing(BODY, q=(1.2, -1.5))
    before = energy(swing.state)
    swing.go(5.0)
    assert energy(swing.state) == pytest.approx(before, abs=1e-6)
    assert np.ptp(swing.state[DQ]) > 0.1


COUPLED = np.array([[9.0, 2.0, 1.0], [2.0, 5.0, -1.5], [1.0, -1.5, 3.0]])
"""kg, the mass matrix of three slides."""


@njit(REACTION)
def _slides(at, state, values, geometry, joint, out):
    for j in range(3):
        for k in range(3):
            out[j] += values[0] * COUPLED[j, k] * at.ddq[k]


def test_a_machine_of_three_joints_goes_as_far_as_newton_has_it():
    mechanism = replace(
        LEG,
        kinds=("prismatic",) * 3,
        parameters=LEG.parameters[:1],
        reactions={"rigid_bodies": _slides},
    )
    machine = Machine(mechanism, tuple(Joint(name, "prismatic") for name in "xyz"))
    a = assemble(Model((Term(RigidBody(on=machine), np.array([2.0])),)), GEOMETRY, machine.names)
    assert_allclose(masses(a)[0], np.broadcast_to(2.0 * COUPLED, (500, 3, 3)))
    state, force = resting_state(np.zeros(3)), np.array([3.0, -2.0, 5.0])
    scratch = workspace(3), stages(3, 0)
    for k in range(100):
        step(a, *scratch, 0.01 * k, 0.01, state, np.zeros(0), np.zeros(3), force)
    assert_allclose(state[Q], 0.5 * np.linalg.solve(2.0 * COUPLED, force), rtol=1e-9)


def test_viscous_friction_only_takes_energy_until_the_leg_hangs():
    swing = Swing(BODY, *friction(0.0, 4.0), q=(1.0, -1.0))
    levels = [energy(swing.go(0.5).state) for _ in range(30)]
    assert np.all(np.diff(levels) < 1e-9)
    assert_allclose(swing.state[Q], 0.0, atol=0.02)


def test_a_joint_sticks_while_gravity_stays_below_its_dry_friction():
    q = np.array([0.05, -0.05])
    assert np.all(np.abs(gravity_torque(LEG, q, X, GEOMETRY)) < 4.0)
    swing = Swing(BODY, *friction(4.0, 1.0), q=q).go(2.0)
    assert_allclose(swing.state[Q], q, atol=1e-9)
    assert_allclose(swing.state[DQ], 0.0, atol=1e-9)


def test_a_joint_breaks_away_once_the_torque_exceeds_its_dry_friction():
    held = Swing(BODY, *friction(4.0, 1.0), q=(0.0, 0.0), torque=(3.9, 0.0)).go(0.5)
    moved = Swing(BODY, *friction(4.0, 1.0), q=(0.0, 0.0), torque=(4.3, 0.0)).go(0.5)
    assert abs(held.state[Q, 0]) < 1e-6
    assert moved.state[Q, 0] > 1e-4


def test_a_moving_joint_comes_to_rest_without_chatter():
    swing = Swing(BODY, *friction(6.0, 2.0), q=(0.6, -0.4)).go(4.0)
    at_rest = swing.state.copy()
    swing.go(1.0)
    assert_allclose(swing.state, at_rest, atol=1e-7)


def test_the_step_converges_with_its_fourth_power():
    ends = [Swing(BODY, q=(1.2, -1.5), h=h).go(0.8).state.copy() for h in (4e-3, 2e-3, 1e-3)]
    coarse, fine = (np.max(np.abs(end - ends[2])) for end in ends[:2])
    assert 12 < coarse / fine < 22


def test_a_stiff_spring_is_nearly_no_spring():
    rigid = Swing(BODY, *friction(1.0, 2.0), q=(0.8, -0.8)).go(0.5)
    stiff = Swing(
        BODY,
        *friction(1.0, 2.0),
        Term(JointElasticity("knee"), np.array([1e5])),
        q=(0.8, -0.8),
        h=5e-5,
    )
    stiff.go(0.5)
    # The motor's inertia, which the rigid leg has not, slows the knee a little.
    assert_allclose(stiff.state[Q], rigid.state[Q], atol=0.05)
    assert abs(stiff.state[THETA, 1] - stiff.state[Q, 1]) < 1e-3


def test_a_spring_at_rest_twists_by_the_load_over_its_stiffness():
    """The motor is held by dry friction, the shank hangs from the spring."""
    spring = Term(JointElasticity("knee"), np.array([500.0]))
    swing = Swing(BODY, *friction(40.0, 1.0), spring, q=(0.3, -0.8)).go(8.0)
    twist = swing.state[THETA, 1] - swing.state[Q, 1]
    assert_allclose(swing.state[DTHETA], 0.0, atol=1e-6)
    assert twist == pytest.approx(
        gravity_torque(LEG, swing.state[Q], X, GEOMETRY)[1] / 500.0, rel=1e-3
    )


def test_presliding_holds_like_a_spring_before_it_slides():
    """Dahl: a small push bends the contact by travel x push / F to first order, and it stays
    there."""
    push, level, travel = 0.4, 4.0, 0.02
    dahl = Term(PreslidingHysteresis("knee"), np.array([level, travel]))
    hip_locked = Term(Friction("hip"), np.array([50.0, 0.0]))
    # Viscous enough not to overshoot: what slid too far would stay there.
    knee = Term(Friction("knee"), np.array([0.0, 40.0]))
    swing = Swing(BODY, hip_locked, knee, dahl, q=(0.0, 0.0), torque=(0, push)).go(6.0)
    # Gravity of the shank adds its own stiffness beside the contact's.
    stiffness = level / travel + GEOMETRY.gravity_m_s2 * X[2]
    assert swing.state[Q, 1] == pytest.approx(push / stiffness, rel=0.06)


def test_two_transmissions_at_one_joint_are_refused():
    spring = Term(JointElasticity("knee"), np.array([500.0]))
    with pytest.raises(
        InputError, match="joint_elasticity@knee: the joint has another transmission already"
    ):
        assemble(Model((BODY, spring, spring)), GEOMETRY)
