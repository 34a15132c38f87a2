"""One joint: its equations against Newton's, and which mechanism a file's joints ask for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from pipelines.contracts.joints import Joint
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.instant import Instant
from pipelines.mechanics.machine import MECHANISMS, machine_of
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.mechanisms.single import LIFT, PENDULUM, SLIDE, TURNTABLE
from tests.mechanics.equations import coriolis_matrix, gravity_torque

EARTH, LEVEL = Geometry(gravity_m_s2=9.81), Geometry(gravity_m_s2=0.0)
every = pytest.mark.parametrize("mechanism", MECHANISMS, ids=lambda m: m.title.split(":")[0])


def test_a_pendulum_that_swings_freely_needs_no_torque():
    mass, length = 0.7, 0.4
    time = np.linspace(0, 3, 400)
    swing = solve_ivp(
        lambda _, s: [s[1], -9.81 / length * np.sin(s[0])],
        (0, 3),
        [1.2, 0.3],
        t_eval=time,
        rtol=1e-11,
        atol=1e-11,
    )
    q, dq = swing.y[:, :, np.newaxis]
    torque = PENDULUM.regressor(q, dq, -9.81 / length * np.sin(q), EARTH) @ [
        mass * length**2,
        mass * length,
    ]
    assert_allclose(torque, 0, atol=1e-9)
    assert np.abs(gravity_torque(PENDULUM, [0.5], [0.0, mass * length], EARTH)) == pytest.approx(
        mass * 9.81 * length * np.sin(0.5)
    )


@every
def test_the_parts_of_a_mechanism_add_up_to_its_regressor(mechanism):
    joints, p = len(mechanism.kinds), len(mechanism.parameters)
    draw = np.random.default_rng(4)
    X = draw.uniform(0.5, 3.0, p)
    for q, dq, ddq in draw.uniform(-2, 2, (20, 3, joints)):
        whole = mechanism.regressor(q[None], dq[None], ddq[None], EARTH)[0] @ X
        parts = (
            mechanism.mass_matrix(q, X, EARTH) @ ddq
            + coriolis_matrix(mechanism, q, dq, X, EARTH) @ dq
        )
        assert_allclose(parts + gravity_torque(mechanism, q, X, EARTH), whole, atol=1e-12)


@every
def test_the_least_inertia_is_positive_exactly_if_a_machine_can_exist(mechanism):
    draw, real = np.random.default_rng(8), {True: 0, False: 0}
    for X in draw.uniform(-0.5, 3.0, (200, len(mechanism.parameters))):
        least, largest, slope = mechanism.least_inertia(X, EARTH)
        assert (least > 0.0) == (mechanism.unrealizable(X, EARTH) == [])
        assert least <= largest
        assert_allclose(slope @ X, least, atol=1e-12)
        real[least > 0.0] += 1
    assert min(real.values()) > 10


@every
def test_the_torque_at_an_instant_is_that_along_a_motion(mechanism):
    joints, geometry = len(mechanism.kinds), EARTH.array()
    draw = np.random.default_rng(6)
    X = draw.uniform(0.5, 3.0, len(mechanism.parameters))
    for q, dq, ddq in draw.uniform(-2, 2, (20, 3, joints)):
        torque, none = np.zeros(joints), np.zeros(joints)
        mechanism.reactions["rigid_bodies"](
            Instant(0.0, q, dq, ddq, none, none, none), np.zeros(0), X, geometry, -1, torque
        )
        assert_allclose(
            torque, mechanism.regressor(q[None], dq[None], ddq[None], EARTH)[0] @ X, atol=1e-12
        )


def test_a_slide_and_a_turntable_are_inertia_alone_and_a_lift_has_weight():
    q, dq, ddq = np.random.default_rng(5).normal(size=(3, 7, 1))
    for mechanism in (SLIDE, TURNTABLE):
        assert_allclose(mechanism.regressor(q, dq, ddq, LEVEL)[:, 0, 0], ddq[:, 0])
    assert_allclose(LIFT.regressor(q, dq, ddq, EARTH) @ [2.0, 30.0], 2.0 * ddq + 30.0)


@pytest.mark.parametrize(
    ("kinds", "geometry", "expected"),
    [
        (("revolute", "revolute"), EARTH, LEG),
        (("revolute",), EARTH, PENDULUM),
        (("revolute",), LEVEL, TURNTABLE),
        (("prismatic",), EARTH, LIFT),
        (("prismatic",), LEVEL, SLIDE),
    ],
)
def test_joints_and_gravity_decide_the_mechanism(kinds, geometry, expected):
    joints = [Joint(f"joint_{i}", kind) for i, kind in enumerate(kinds)]
    assert machine_of(joints, geometry).mechanism is expected


def test_a_mechanism_that_is_not_known_is_refused_with_what_there_is():
    with pytest.raises(
        InputError,
        match=(
            r"a\.parquet has joints x \(prismatic\), y \(revolute\) and gravity 9\.81 m/s²,"
            r" expected those of a mech"
            r"anism that exoid knows: two revolute joints in series, .*; one level prismatic"
            r" joint; "
        ),
    ):
        machine_of([Joint("x", "prismatic"), Joint("y")], EARTH, "a.parquet")


@every
def test_only_machines_that_cannot_exist_are_reported(mechanism):
    X = np.array([2.0, 0.5, 0.1, 1.0])[: len(mechanism.parameters)]
    assert mechanism.unrealizable(X, EARTH) == []
    assert "is not positive" in mechanism.unrealizable(-X, EARTH)[0]
