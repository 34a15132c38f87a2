"""The rig of the blind examination obeys mechanics, and agrees with exoid where nothing is
hidden."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG, cuff_torque
from tests.campaigns.blind import loop
from tests.campaigns.blind.body import PAYLOAD_INERTIA, Body, Payload, Segment
from tests.campaigns.blind.causes import FIRM_CUFF
from tests.campaigns.blind.excitation import FASTEST, HIGHEST, LOWEST, STEEPEST, random_excitation
from tests.campaigns.blind.machine import random_machine
from tests.campaigns.blind.people import Person, random_person
from tests.campaigns.blind.plan import HIP, KNEE, Plan, Run
from tests.campaigns.blind.plant import empty_log, move
from tests.campaigns.blind.recorded import Rig
from tests.campaigns.blind.transmissions import ELASTIC
from tests.mechanics.equations import potential_energy

SEED = 900_000
PERSON = Person(75.0, 1.75)


@pytest.fixture
def rig():
    rng = np.random.default_rng(SEED)
    person = random_person(rng)
    return Rig(random_machine(rng, person.thigh_length), person)


@pytest.fixture
def excitation():
    return random_excitation(np.random.default_rng(SEED))


def run_of(kind="exo_alone", duration=10.0):
    return Run(kind, "train", duration, np.random.default_rng(0))


def free_swing(start, samples):
    """The wearer's leg alone, without friction or drives."""
    none, pair = np.zeros(2), np.zeros((2, 2))
    joints = loop.Joints(
        none, none, pair, np.zeros(2, int), none, np.zeros((2, 5)), np.zeros((2, 6)), np.ones(3)
    )
    drives = loop.Drives(none, none, none, none, none, np.zeros((2, 6)), 1.0, none)
    world = loop.World(PERSON.leg.gravity, np.zeros(3), np.array([-1.0, 0.0, 0.0, 1.0, 1.0]))
    still = loop.Excited(np.array(start), pair, pair, 1.0, np.zeros((0, 4)))
    log = empty_log(samples)
    body = Body(PERSON.leg)
    loop.simulate(
        body.handles,
        still,
        drives,
        joints,
        world,
        Plan().hidden(),
        np.array(start),
        samples,
        5,
        False,
        log,
    )
    return log.link[:, :2], log.link[:, 2:4]


def test_free_swing_keeps_its_energy():
    geometry = Geometry(PERSON.thigh_length, PERSON.leg.gravity)
    X = PERSON.leg.inertial()
    q, dq = free_swing([0.8, -1.2], 2000)
    energy = [
        0.5 * v @ LEG.mass_matrix(x, X, geometry) @ v + potential_energy(x, X, geometry)
        for x, v in zip(q, dq, strict=True)
    ]
    swing = potential_energy([0.8, -1.2], X, geometry) - potential_energy([0.0, 0.0], X, geometry)
    assert np.ptp(energy) < 5e-3 * swing


def test_small_swings_have_the_period_of_the_linear_modes():
    X, length, g = PERSON.leg.inertial(), PERSON.thigh_length, PERSON.leg.gravity
    M = LEG.mass_matrix([0.0, 0.0], X, Geometry(length, g))
    K = g * np.array([[X[3] + X[2], X[2]], [X[2], X[2]]])
    squares, shapes = eigh(K, M)
    for square, shape in zip(squares, shapes.T, strict=True):
        q, _ = free_swing(0.01 * shape / np.abs(shape).max(), 4000)
        falls = np.flatnonzero((q[:-1, 0] > 0) & (q[1:, 0] <= 0))
        crossing = falls + q[falls, 0] / (q[falls, 0] - q[falls + 1, 0])
        period = loop.SAMPLE_S * np.mean(np.diff(crossing))
        assert period == pytest.approx(2 * np.pi / np.sqrt(square), rel=1e-3)


def test_mujoco_and_exoid_have_the_same_equations_of_motion(rig, excitation):
    q, dq, ddq = excitation.at(np.linspace(0.0, 10.0, 500))
    leg = rig.leg(run_of("with_human"))
    Y = LEG.regressor(q, dq, ddq, Geometry(leg.length, leg.gravity))
    assert_allclose(Body(leg).inverse(q, dq, ddq), Y @ leg.inertial(), atol=1e-9)


def test_excitation_keeps_table_2(excitation):
    q, dq, ddq = excitation.at(np.linspace(0.0, 10.0, 5001))
    assert np.all(q >= LOWEST) and np.all(q <= HIGHEST)
    assert np.abs(dq).max() <= FASTEST and np.abs(ddq).max() <= STEEPEST


def test_a_payload_that_is_there_from_the_start_is_part_of_its_segment(rig, excitation):
    carried, grown = Plan(), Plan()
    carried.payload, carried.load = Payload(KNEE, 0.3), np.array([1.5, -10.0, 0.1, 1.0])
    grown.lumps.append((KNEE, Segment(1.5, 0.3, 1.5 * PAYLOAD_INERTIA)))
    torques = [
        move(rig, excitation, plan, run_of(duration=2.0), 400).torque for plan in (carried, grown)
    ]
    assert_allclose(*torques, atol=1e-6)


def test_a_joint_that_reverses_sticks_for_a_while(rig, excitation):
    speed = move(rig, excitation, Plan(), run_of(), 2000).speed
    assert np.mean(speed == 0.0) > 0.002


def test_a_transmission_winds_up_by_torque_over_stiffness(rig, excitation):
    rig = Rig(rig.machine.tuned_for_soft(HIP), rig.person)
    plan = Plan()
    plan.soft(HIP, ELASTIC, 800.0, 0.5)
    log = move(rig, excitation, plan, run_of("with_human"), 2000)
    wound = log.angle[:, HIP] - log.link[:, HIP]
    needed = Body(rig.leg(run_of("with_human"))).inverse(
        *(log.link[:, 2 * i : 2 * i + 2] for i in range(3))
    )
    assert np.corrcoef(wound, needed[:, HIP])[0, 1] > 0.98
    assert np.polyfit(needed[:, HIP], wound, 1)[0] == pytest.approx(1 / 800.0, rel=0.05)


@pytest.mark.parametrize("tilt", [0.0, 0.1])
@pytest.mark.parametrize("cuffs", [None, np.array([FIRM_CUFF] * 2)], ids=["one leg", "two legs"])
def test_cuff_forces_measure_the_torque_that_the_wearer_takes(rig, excitation, cuffs, tilt):
    from tests.campaigns.blind.plant import _cuff_forces

    machine = rig.machine
    quiet = Rig(
        type(machine)(**{**vars(machine), "cuff_zero": np.zeros((4, 3)), "cuff_noise": 0.0}),
        rig.person,
    )
    plan = Plan()
    plan.cuffs, plan.tilt[0] = cuffs, tilt
    log = move(quiet, excitation, plan, run_of("with_human"), 2000)
    forces = _cuff_forces(quiet, plan, log, np.random.default_rng(0))
    geometry = Geometry(machine.leg.length, machine.leg.gravity, *machine.cuff_distance)
    q = log.link[:, :2]
    measured = cuff_torque(forces[:, 0] + forces[:, 1], forces[:, 2] + forces[:, 3], q, geometry)
    taken = Body(rig.person.leg).inverse(
        q + np.array([tilt, 0.0]), log.link[:, 2:4], log.link[:, 4:6]
    )
    assert np.sqrt(np.mean((measured - taken) ** 2)) < (
        1e-9 if cuffs is None else 0.04 * np.sqrt(np.mean(taken**2))
    )


def test_pads_press_and_never_pull(rig, excitation):
    from tests.campaigns.blind.plant import record

    run = run_of("with_human")
    recorded = record(rig, excitation, Plan(), run, np.random.default_rng(0))
    across = recorded.forces[:, :, 1] - rig.machine.cuff_zero[:, 1]
    assert np.all(across[:, [0, 2]] < 5 * rig.machine.cuff_noise)
    assert np.all(across[:, [1, 3]] > -5 * rig.machine.cuff_noise)
