"""A load that swings on a transmission's spring, driven by the motion before it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import (
    DTHETA,
    THETA,
    Q,
    accelerations,
    resting_state,
    stages,
    step,
    workspace,
)
from pipelines.effects.backlash import SHAFT_STIFFNESS, Backlash
from pipelines.effects.baseline import RigidBody
from pipelines.effects.cuff_compliance import CuffCompliance
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.kernel import address, swing_along
from pipelines.effects.swing import behind_spring, rotor_among_links
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.motion import Motion
from pipelines.model import Model, Term

X = np.array([2.6, 0.63, 1.78, 5.7])
JOINTS = ("hip", "knee")


def swung(stiffness, torque, inertia, ratio=0.0, h=0.005):
    """Return the twist of a constant inertia on an elastic joint's spring."""
    twist, zero = np.empty(len(torque)), np.zeros(len(torque))
    spring = address(JointElasticity("hip").spring)
    swing_along(
        spring, np.array([stiffness]), ratio, 0.02, h, torque, zero + inertia, zero, zero, twist
    )
    return twist


@pytest.mark.parametrize(("stiffness", "inertia"), [(300.0, 2.0), (800.0, 0.7), (3000.0, 0.3)])
def test_a_load_let_go_swings_at_the_root_of_stiffness_over_inertia(stiffness, inertia):
    torque = np.zeros(2000)
    torque[0] = 10.0
    twist = swung(stiffness, torque, inertia)
    upward = np.flatnonzero((twist[:-1] < 0.0) & (twist[1:] >= 0.0))
    crossings = upward + twist[upward] / (twist[upward] - twist[upward + 1])
    period = np.mean(np.diff(crossings[:5])) * 0.005
    assert_allclose(2.0 * np.pi / period, np.sqrt(stiffness / inertia), rtol=0.02)


def test_a_slow_load_is_followed_at_once_by_any_spring():
    torque = 20.0 * np.cos(0.5 * np.arange(0.0, 10.0, 0.005))
    for stiffness in (300.0, 1e4, 1e7, 1e10):
        assert_allclose(
            swung(stiffness, torque, 0.5), torque / stiffness, atol=0.02 * 20.0 / stiffness
        )


def test_a_load_that_a_fit_has_made_of_nothing_does_not_run_away():
    """Gravity that pushes up harder than the spring holds: undisturbed it would be beyond any
    number in seconds."""
    twist, ones = np.empty(20_000), np.ones(20_000)
    spring = address(JointElasticity("hip").spring)
    swing_along(spring, np.array([100.0]), 0.0, 0.02, 0.005, ones, -ones, -ones, -1e4 * ones, twist)
    assert np.isfinite(twist).all()
    assert np.abs(twist).max() <= np.pi


def test_a_copy_that_is_damped_more_forgets_an_error_of_the_load_sooner():
    steady, wrong = np.full(1000, 5.0), np.full(1000, 5.0)
    wrong[:20] = 25.0
    left = [
        np.abs(swung(500.0, wrong, 1.0, ratio) - swung(500.0, steady, 1.0, ratio))[800:].max()
        for ratio in (0, 0.1)
    ]
    assert left[1] < 0.01 * left[0]


@pytest.mark.parametrize("effect", [JointElasticity, CuffCompliance])
@pytest.mark.parametrize("joint", JOINTS)
def test_the_slower_the_motion_the_nearer_is_the_link_to_torque_over_stiffness(
    with_human, effect, joint
):
    bound, stiffness = effect(joint), 1500.0
    errors = []
    # Gravity would pull the twisted link a little further, at any speed.
    m = replace(with_human, geometry=replace(with_human.geometry, gravity_m_s2=0.01))
    for slow in (2.0, 8.0):
        motion = replace(
            m,
            time=slow * m.time,
            sample_rate_hz=m.sample_rate_hz / slow,
            cutoff_hz=12.0 / slow,
            dq=m.dq / slow,
            ddq=m.ddq / slow**2,
            body=X,
            limb_body=X,
        )
        # A rotor that the body holds turns with the motor.
        rotor = rotor_among_links(motion, joint) if effect is JointElasticity else 0.0
        load = Model((Term(RigidBody(), X - [rotor, 0.0, 0.0, 0.0]),)).torque(motion)
        swing = bound.corrected(motion, (stiffness,)).q
        at_once = bound.corrected(
            replace(motion, body=None, limb_body=None, load=load, limb_load=load), (stiffness,)
        ).q
        inside = slice(200, -200)
        errors.append(
            np.abs(swing - at_once)[inside].max() / np.abs(at_once - motion.q)[inside].max()
        )
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 0.05


@pytest.mark.parametrize(
    ("effect", "shape", "ratio", "error"),
    [
        (JointElasticity, (300.0, 0.0), 0.0, 0.05),
        (Backlash, (0.02, SHAFT_STIFFNESS), 1.0, 0.3),
    ],
    ids=["spring", "play"],
)
@pytest.mark.parametrize("joint", JOINTS)
def test_the_link_behind_a_motor_is_where_forward_dynamics_puts_it(
    joint, effect, shape, ratio, error
):
    """Both from the same torque: one integrates motor and link, one the link behind the motor's
    motion."""
    bound = effect(joint)
    model = Model((Term(RigidBody(), X), Term(bound, np.array(shape))))
    states, ddtheta = simulated(model, seconds=6.0)
    n = len(states)
    motion = Motion(
        np.arange(n) * 0.005,
        states[:, THETA],
        states[:, DTHETA],
        ddtheta,
        np.zeros((n, 2)),
        np.zeros(n, np.int64),
        np.ones(n, bool),
        cutoff_hz=60.0,
        body=X,
    )
    direction = np.zeros((n, 2))
    direction[:, bound.column(motion)] = 1.0
    link = behind_spring(motion, X, direction, bound, shape, ratio)
    twist, found = motion.q - states[:, Q], motion.q - link.q
    assert np.abs(twist).max() > 0.4 * min(0.05, shape[0])
    assert np.std((found - twist)[100:-100]) < error * np.std(twist)


@pytest.mark.parametrize("rotor", [0.0, 0.3])
def test_what_turns_with_the_motor_does_not_hang_on_the_spring(rotor):
    """A body that holds a rotor, the rotor taken off, swings as the body without it."""
    t = np.arange(0.0, 5.0, 0.005)
    q = np.column_stack([0.3 * np.sin(4.0 * t), 0.2 * np.cos(5.0 * t)])
    dq, ddq = (
        np.gradient(q, 0.005, axis=0),
        np.gradient(np.gradient(q, 0.005, axis=0), 0.005, axis=0),
    )
    n, with_rotor = len(t), X + np.array([rotor, 0.0, 0.0, 0.0])
    motion = Motion(
        t, q, dq, ddq, np.zeros((n, 2)), np.zeros(n, np.int64), np.ones(n, bool), body=X
    )
    direction = np.tile([1.0, 0.0], (n, 1))
    spring = direction, JointElasticity("hip"), (400.0, 0.0)
    swung_alone = behind_spring(motion, X, *spring)
    holding = replace(motion, body=with_rotor)
    less = behind_spring(holding, with_rotor, *spring, 0.0, rotor)
    assert_allclose(less.q, swung_alone.q, atol=1e-12)
    if rotor:
        more = behind_spring(holding, with_rotor, *spring)
        assert np.abs(more.q - swung_alone.q).max() > 1e-3


def simulated(model, seconds):
    """Swing a leg that hangs at rest: states (n, 4, 2) and the motors' accelerations (n, 2), every
    5 ms."""
    a, w, s = assemble(model, Geometry()), workspace(2), stages(2, 0)
    state, memory, load, rates = (
        resting_state(np.zeros(2)),
        np.zeros(0),
        np.zeros(2),
        np.zeros((4, 2)),
    )
    states, accelerated = [], []
    for i in range(round(seconds / 2.5e-4)):
        t = 2.5e-4 * i
        drive = np.array([30.0, 10.0]) * np.sin(4.0 * t) - 4.0 * state[DTHETA]
        if i % 20 == 0:
            accelerations(a, w, t, state, memory, np.sign(state[DTHETA]), load, drive, rates)
            states.append(state.copy())
            accelerated.append(rates[DTHETA].copy())
        step(a, w, s, t, 2.5e-4, state, memory, load, drive)
    return np.array(states), np.array(accelerated)


@pytest.mark.parametrize("with_load", [False, True])
@pytest.mark.parametrize("before", [None, "load_columns", "on_limb", "transmitted"])
def test_a_corrected_motion_depends_on_nothing_that_was_computed_of_the_measured_one(
    before, with_load
):
    """The load of a body is that along the corrected motion, whoever asked for the measured one's
    first."""
    t = np.arange(0.0, 5.0, 0.005)
    q = np.column_stack([0.3 * np.sin(4.0 * t), 0.2 * np.cos(5.0 * t)])
    dq, ddq = (
        np.gradient(q, 0.005, axis=0),
        np.gradient(np.gradient(q, 0.005, axis=0), 0.005, axis=0),
    )
    n = len(t)
    measured = Motion(
        t,
        q,
        dq,
        ddq,
        np.sin(np.column_stack([t, t])),
        np.zeros(n, np.int64),
        np.ones(n, bool),
        body=X,
        limb_body=X,
        forces=np.ones((n, 4, 3)),
        geometry=Geometry(thigh_cuff_distance_m=0.2, shank_cuff_distance_m=0.2),
        limb_load=np.cos(np.column_stack([t, t])) if with_load else None,
    )
    if before:
        getattr(measured, before)
    moved, alone = measured.with_state(q + 0.2, dq, ddq), replace(measured, q=q + 0.2)
    direction = np.tile([1.0, 0.5], (n, 1))
    for of in (
        lambda motion: motion.load_columns.projected(direction) @ X,
        lambda motion: motion.on_limb,
        lambda motion: motion.transmitted,
    ):
        assert all(
            (found == expected).all() for found, expected in zip(of(moved), of(alone), strict=True)
        )
