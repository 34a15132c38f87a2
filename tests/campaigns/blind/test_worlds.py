"""The worlds without MuJoCo obey mechanics, and every world hides what it promises to hide."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipelines.contracts import RECORDING
from tests.campaigns.blind import planar, two_link, two_mass
from tests.campaigns.blind.body import Body
from tests.campaigns.blind.cases import CAUSES, Case
from tests.campaigns.blind.causes import FORMS
from tests.campaigns.blind.conditions import Conditions
from tests.campaigns.blind.families import FAMILIES, OF_CATALOGUE
from tests.campaigns.blind.floor import noise_floor, ripple_floor
from tests.campaigns.blind.legs import links_of
from tests.campaigns.blind.loop import Excited
from tests.campaigns.blind.magnitude import magnitude
from tests.campaigns.blind.outside import KINDS
from tests.campaigns.blind.people import Person
from tests.campaigns.blind.plan import HIP, KNEE, Plan, Run
from tests.campaigns.blind.recorded import Rig
from tests.campaigns.blind.session import simulate, write
from tests.campaigns.blind.trajectories import random_trajectory
from tests.campaigns.blind.transmissions import per_metre
from tests.campaigns.blind.worlds import WORLDS

SEED = 900_400
CLOSED_FORM = (planar, two_mass)
NEW_WORLDS = ("planar", "two_mass")
QUIET = Conditions(duration_s=6.0)


def rng(number=0):
    return np.random.default_rng([SEED, number])


def run_of(kind="exo_alone", duration=6.0):
    return Run(kind, "train", duration, rng(1))


def rig_of(world):
    person = Person(80.0, 1.8)
    return Rig(world.random_machine(rng(), person.thigh_length), person)


def free_swing(world, start, samples):
    """The machine's leg without friction, drives, or damping of what is stiff."""
    rig, plan = rig_of(world), Plan()
    none, still = np.zeros(2), np.array(start)
    drives = world._drives(rig, plan, run_of()) if world is two_mass else None
    joints = world._joints(rig, plan)._replace(coulomb=none, viscous=none)
    if world is planar:
        drives = planar.Drives(
            *(none,) * 3, 0.0, none, none, none, none, np.zeros((2, 6)), 1.0, 1.0, 4
        )
        joints = joints._replace(bristle=np.full(2, 1e-3), bristle_damping=none)
    else:
        drives = drives._replace(count=none, recorded_count=none)
        joints = joints._replace(gear_loss=none, spring=joints.spring * np.array([1, 0, 1, 1, 1]))
    at_rest = Excited(still, np.zeros((2, 1)), np.zeros((2, 1)), 1.0, np.zeros((0, 4)))
    log, steps = world.empty_log(samples, 5), 5 * world.STEPS_PER_MS
    links = links_of(rig, plan, run_of())
    world.simulate(at_rest, drives, joints, links, plan.hidden(), still, samples, steps, False, log)
    return rig, joints, log


def energy(rig, joints, log, rotors):
    """Kinetic, potential and elastic energy, (n,) J; ``rotors`` turn with the motors."""
    c = two_link.coefficients(rig.machine.leg)
    M, bias, total = np.empty((2, 2)), np.empty(2), []
    for q, v, th in zip(log.link[:, :2], log.link[:, 2:4], log.angle, strict=True):
        two_link.mass_and_bias(c, 0.0, 0.0, q[0], q[1], 0.0, 0.0, M, bias)
        f1, f2, g = q[0], q[0] + q[1], rig.machine.leg.gravity
        height = c[two_link.M1] * np.cos(f1) + c[two_link.M2] * np.cos(f2)
        elastic = 0.5 * joints.spring[:, 0] @ (th - q) ** 2
        total.append(0.5 * v @ M @ v + 0.5 * rotors @ v**2 - g * height + elastic)
    return np.array(total)


@pytest.mark.parametrize("world", CLOSED_FORM, ids=NEW_WORLDS)
def test_free_swing_keeps_its_energy(world):
    rig, joints, log = free_swing(world, [0.9, -1.1], 1000)
    rotors = joints.inertia if world is two_mass else np.array([rig.machine.hip_rotor, 0.0])
    energies = energy(rig, joints, log, rotors)
    moved = np.ptp(0.5 * rotors @ log.link[:, 2:4].T ** 2) + np.ptp(log.link[:, 0])
    assert moved > 0.5
    assert np.ptp(energies) < 0.01 * np.ptp(log.link[:, 2] ** 2)


@pytest.mark.parametrize("name", WORLDS)
def test_a_rig_with_nothing_hidden_reports_what_mujoco_needs(name):
    """Away from reversals, what is reported less MuJoCo's and the friction's torque is small."""
    world = WORLDS[name]
    rig, run = world.rig(rng(2)), run_of("with_human", 12.0)
    motion = random_trajectory(rng(3), 12.0, True, "gait")
    r = world.record(rig, motion, Plan(), run, rng(4), replace(QUIET, duration_s=12.0))
    moving = r.moving()
    residual = np.array(
        [np.sqrt(np.mean(r.blocks(r.effect)[moving[:, j], j] ** 2)) for j in (0, 1)]
    )
    torque = np.sqrt(np.mean(r.clean_torque**2, axis=0))
    # The gears and the cuffs of two masses give way a little, all the time.
    assert np.all(residual < (0.02 if name == "two_mass" else 0.0005) * torque)
    if name == "planar":
        q, dq, ddq = (np.ascontiguousarray(r.link[:, 2 * i : 2 * i + 2]) for i in range(3))
        needed = Body(rig.leg(run)).inverse(q, dq, ddq)
        needed[:, HIP] += rig.machine.hip_rotor * ddq[:, HIP]
        needed += rig.machine.coulomb * np.sign(dq) + rig.machine.viscous * dq
        away = r.away_from_reversals()
        assert np.abs(r.clean_torque - needed)[away].max() < 0.05


def test_gears_of_two_masses_wind_up_by_load_over_stiffness():
    rig = rig_of(two_mass)
    motion = random_trajectory(rng(5), 6.0, True, "multisine")
    log = two_mass.move(rig, motion, Plan(), run_of(), 1200, QUIET)
    q, dq, ddq = (np.ascontiguousarray(log.link[:, 2 * i : 2 * i + 2]) for i in range(3))
    load = Body(rig.machine.leg).inverse(q, dq, ddq)
    slopes = [np.polyfit(load[:, j], log.wound[:, j], 1)[0] for j in (HIP, KNEE)]
    assert slopes == pytest.approx(1.0 / rig.machine.stiffness, rel=0.03)


def test_bristles_stick_where_regularised_friction_creeps():
    motion = random_trajectory(rng(6), 6.0, True, "ramps")
    slow = []
    for world in CLOSED_FORM:
        log = world.move(rig_of(world), motion, Plan(), run_of(), 1200, QUIET)
        slow.append(np.mean(np.abs(log.speed) < 0.002))
    assert min(slow) > 0.02


def test_cuffs_given_by_the_metre_have_the_stiffness_about_their_joints():
    levers = np.array([0.25, 0.2, 0.4])
    cuffs = per_metre(np.array([[9000.0, 10.0, 5.0, 0.01, 0.1, 1.0]] * 2), levers)
    assert cuffs[:, 0] * levers[:2] ** 2 == pytest.approx(9000.0)
    assert cuffs[:, 3] / levers[:2] == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("world", "effect", "joint"),
    [
        ("planar", "end_stop", HIP),
        pytest.param("planar", "friction_temperature", KNEE, marks=pytest.mark.slow),
        ("two_mass", "position_dependent_friction", HIP),
        pytest.param("two_mass", "encoder_eccentricity", KNEE, marks=pytest.mark.slow),
        ("mujoco", "gain_drift", HIP),
    ],
)
def test_a_hidden_effect_has_the_magnitude_that_was_wanted(world, effect, joint):
    session = simulate(Case(SEED + 2, "single", ((effect, joint),), world=world))
    ((cause, _, wanted),) = session.hidden
    assert magnitude(cause, session.runs) == pytest.approx(wanted, rel=0.45)
    truth = [w for _, _, w in session.background]
    assert 2 <= len(truth) <= 5 and all(0.0002 <= w <= 0.0025 for w in truth)


@pytest.fixture(scope="module", params=WORLDS)
def faultless(request, tmp_path_factory):
    session = simulate(Case(SEED + 5, "none", world=request.param))
    folder = tmp_path_factory.mktemp(request.param)
    write(session, folder / "recordings", folder / "truth.json")
    return session, folder


def test_what_a_known_model_leaves_of_a_faultless_session_is_its_noise(faultless):
    session, _ = faultless
    validate = session.of("validate")
    assert noise_floor(session.rig, validate) == pytest.approx(ripple_floor(validate), rel=0.35)


def test_recordings_of_every_world_keep_the_contract_and_their_secret(faultless):
    session, folder = faultless
    truth = json.loads((folder / "truth.json").read_text())
    secrets = {"seed", "mujoco", "planar", "two_mass", *CAUSES, *(h[0] for h in truth["hidden"])}
    for path in sorted((folder / "recordings").iterdir()):
        table = RECORDING.read(path)
        assert table.metadata["sample_rate_hz"] == session.conditions.rate_hz
        assert ("period_s" in table.metadata) == session.conditions.says_period
        schema = pq.read_schema(path)
        text = " ".join([*schema.names, *(v.decode() for v in schema.metadata.values())])
        assert not [secret for secret in secrets if secret in text]


def test_every_effect_has_three_forms_and_the_new_worlds_have_forms_of_their_own():
    few = [effect for effect, forms in FORMS.items() if len(forms) < 3]
    assert not few, "give these more forms in further_forms.py or further_torques.py"
    assert all(any(not f.own for f in forms) for forms in FORMS.values())
    for world in NEW_WORLDS:
        others = {
            effect: [
                f for f in forms if world in f.worlds and WORLDS["mujoco"].name not in f.worlds
            ]
            for effect, forms in FORMS.items()
            if any(f.plain for f in forms)
        }
        assert not [effect for effect, forms in others.items() if not forms]


def test_every_effect_and_every_unlisted_kind_has_families():
    assert set(OF_CATALOGUE) == set(FORMS), "families.py has the families of each effect"
    kinds = [*OF_CATALOGUE.values(), *KINDS.values()]
    assert all(kind.families and set(kind.families) <= set(FAMILIES) for kind in kinds)
    assert len(KINDS) >= 12
    assert sum(kind.held_back for kind in KINDS.values()) >= 3
