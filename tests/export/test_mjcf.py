"""MuJoCo moves the exported machine as exoid's own forward dynamics does."""

import mujoco
import numpy as np
import pytest

from pipelines.effects import Side
from pipelines.export import MJCF, Degree
from pipelines.model import Term
from tests.export.machines import CAUSES, LEG, acceleration, machine, named, torque

RELATIVE = 1e-6
HELD = [t for t in CAUSES if MJCF.holding(t).degree is Degree.EXACT]
RIGID = [term for term in HELD if term.effect.spring is None]


def simulated(made, states, control, twist=()):
    """Return MuJoCo's accelerations, (n, dof), the encoders' angles as ``qpos``."""
    model = mujoco.MjModel.from_xml_string(MJCF.write(made, "leg")[".xml"])
    data, found = mujoco.MjData(model), []
    for k in range(len(states.t)):
        for j, joint in enumerate(made.joints):
            motor = model.joint(joint.name)
            data.qpos[motor.qposadr], data.qvel[motor.dofadr] = states.q[k, j], states.dq[k, j]
            data.ctrl[model.actuator(joint.name).id] = control[k, j]
        for name, angle in twist:
            data.qpos[model.joint(name).qposadr] = angle[k]
        data.qacc_warmstart[:] = 0.0
        mujoco.mj_forward(model, data)
        found.append(data.qacc.copy())
    return np.array(found)


def agree(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=RELATIVE * np.abs(expected).max())


@pytest.fixture(scope="module")
def drive(states, leg):
    """Torques that stop no joint within a step: MuJoCo's friction would then hold it, and ours
    still rub."""
    return torque(leg, states) + np.random.default_rng(3).uniform(-5.0, 5.0, states.q.shape)


def test_the_bare_leg_accelerates_as_ours_does(leg, states, drive):
    agree(simulated(leg, states, drive), acceleration(leg, states, drive)[0])


@pytest.mark.parametrize(
    "term",
    [t for t in RIGID if t.effect.torque_reading is None],
    ids=lambda term: term.effect.label,
)
def test_a_leg_with_a_cause_accelerates_as_ours_does(term, states, drive):
    made = machine(*LEG, term)
    agree(simulated(made, states, drive), acceleration(made, states, drive)[0])


def test_causes_are_held_beside_one_another(states, drive):
    made = machine(*LEG, *(t for t in RIGID if t.effect.torque_reading is None))
    agree(simulated(made, states, drive), acceleration(made, states, drive)[0])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["gain first", "offset first"])
def test_control_is_the_torque_that_the_channel_would_say(order, states, drive):
    sensors = [named("torque_gain@knee"), named("torque_offset@knee")]
    made = machine(*LEG, *(sensors[i] for i in order))
    said = drive.copy()
    for term in (t for t in made.model if t.effect.side is Side.SENSOR):
        for k in range(len(said)):
            term.effect.torque_reading(
                states.t[k], said[k], term.values, 1, np.zeros(0), np.zeros(2)
            )
    agree(simulated(made, states, said), acceleration(made, states, drive)[0])


@pytest.mark.parametrize("hardening", [0.0, 300.0])
@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_a_link_behind_a_soft_joint_swings_as_ours_does(joint, hardening, states, drive):
    soft = named(f"joint_elasticity@{joint}")
    soft = Term(soft.effect, np.array([600.0, hardening]))
    viscous = [Term(t.effect, np.array([0.0, t.values[1]])) for t in LEG[1:]]
    made = machine(
        LEG[0], *viscous, soft, named(f"parallel_spring@{joint}"), named("rotor_inertia@knee")
    )
    twist = np.zeros_like(states.q)
    j = ("hip", "knee").index(joint)
    twist[:, j] = np.random.default_rng(4).uniform(-0.05, 0.05, len(states.t))
    motor, link = acceleration(made, states, drive, twist)
    found = simulated(made, states, drive, [(f"{joint}_twist", -twist[:, j])])
    # Each joint of MuJoCo turns relative to the one before: the link is the motor and its twist
    # together.
    behind = found[:, j] + found[:, j + 1]
    other = found[:, 2 if j == 0 else 0]
    agree(found[:, j], motor[:, j])
    agree(behind, link[:, j])
    agree(other, link[:, 1 - j])


def test_the_leg_sticks_where_ours_does(leg):
    """Within Coulomb friction no drive moves the leg by more than a soft constraint creeps."""
    model = mujoco.MjModel.from_xml_string(MJCF.write(leg, "leg")[".xml"])
    data = mujoco.MjData(model)
    data.ctrl[:] = 2.0, 1.2
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos).max() < 0.01


def test_masses_and_inertias_pass_what_mujoco_checks(leg):
    model = mujoco.MjModel.from_xml_string(MJCF.write(leg, "leg")[".xml"])
    assert (model.body_mass[1:] > 0).all()
    assert model.opt.gravity[2] == -9.81
