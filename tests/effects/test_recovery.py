"""Hidden in the plant, found by regression: the plant integrates what the regression evaluates."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts.table import Table
from pipelines.effects import RUNS, Side
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.joint_elasticity import MOTOR_INERTIA
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.effects.torque_gain import TorqueGain
from pipelines.estimation.regression import regressions
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.model import Model, Term
from pipelines.rig.plant import JOINTS, Plant
from pipelines.rig.record import LEAD_S, record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import CuffSettings, PlantSettings, TemperatureSettings
from tests.effects.catalogue import TERMS
from tests.effects.conftest import RICH

IDEAL = PlantSettings(
    ripple_nm=(0.0, 0.0), counts_per_turn=(0.0, 0.0), cuff=CuffSettings(noise_n=0.0)
)
WARMING = IDEAL.model_copy(
    update={"temperature": TemperatureSettings(heating_c_nm2=0.05, time_constant_s=5.0)}
)
FRICTION = tuple(
    Term(Friction(joint), np.array([IDEAL.coulomb_nm[j], IDEAL.viscous_nm_s_rad[j]]))
    for j, joint in enumerate(JOINTS)
)
MACHINE = Term(RigidBody(), np.array(IDEAL.exo_inertial))
PERSON = Term(RigidBody(run="with_human"), np.array(IDEAL.human_inertial))
BOTH = MACHINE.values + PERSON.values
BY_LABEL = {term.effect.label: term for term in TERMS}


def moved(run, *terms):
    """Return one period of a machine that has ``terms`` too, and no noise."""
    settings = WARMING if any(term.effect.needs_temperature for term in terms) else IDEAL
    frame, metadata = record(Plant(settings, run, effects=terms), RICH, 10.0)
    # Nothing is noise here: the filter need not take what reversals leave.
    return motion_from_table(motion_table(Table(frame, metadata), FilterSettings(cutoff_hz=25.0)))


def scored(motion, model):
    (regression,) = regressions(motion, model)
    rows = regression.scored
    return regression.regressor[rows], regression.torque[rows]


def fitted(motion, *terms):
    """Return the linear values that fit best, and the RMSE that they leave, N·m over both
    joints."""
    regressor, torque = scored(motion, Model(terms))
    A, b = regressor.reshape(-1, regressor.shape[2]), torque.reshape(-1)
    values = np.linalg.lstsq(A, b)[0]
    return values, np.sqrt(np.mean((b - A @ values) ** 2))


def misfit(motion, *terms):
    """Return the RMSE of a model with all its values, N·m over both joints."""
    model = Model(terms)
    regressor, torque = scored(motion, model)
    return np.sqrt(np.mean((torque - regressor @ model.linear_values) ** 2))


BEGIN = LEAD_S + 0.5 / IDEAL.sample_rate_hz


def since_the_recording_began(term):
    """Return the terms as the recording has them, whose clock starts in the middle of its first
    sample.

    The plant's runs from rest: a gain that drifts is no longer 1 when the recording begins.
    """
    effect, values = term.effect, term.values.copy()
    if effect.name == "payload_change":
        values[1] -= BEGIN
    if effect.name == "friction_warmup":
        values[:2] *= np.exp(-BEGIN / values[2])
    if effect.name == "torque_drift":
        values[1] += BEGIN * values[0]
    if effect.name == "voluntary_torque":
        amplitude, frequency, phase, bias = effect.physical(values)
        values = effect.values_from(
            np.array([amplitude, frequency, phase + 2 * np.pi * frequency * BEGIN, bias])
        )
    if effect.name == "gain_drift":
        at_first = 1.0 + values[0] * BEGIN
        values[0] /= at_first
        return Term(effect, values), Term(TorqueGain(effect.joint), np.array([at_first]))
    return (Term(effect, values),)


HIDDEN = [
    t for t in TERMS if t.effect.name not in ("rigid_body", "friction") and t.effect.spring is None
]


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda term: term.effect.label)
def test_regression_recovers_what_the_plant_hides(hidden):
    run = "with_human" if hidden.effect.side is Side.HUMAN else "exo_alone"
    motion, terms = moved(run, hidden), since_the_recording_began(hidden)
    # What is transmitted is not what was measured, which holds the drive's friction too.
    body = (MACHINE, PERSON) if run == "with_human" else (MACHINE,)
    motion = replace(motion, load=Model(body).torque(motion))
    without = fitted(motion, MACHINE, *FRICTION)[1]
    values, left = fitted(motion, MACHINE, *FRICTION, *terms)
    assert left < without / 20.0
    if len(hidden.effect.linear):
        found = values[-len(hidden.effect.linear) :]
        assert_allclose(found, terms[0].linear, rtol=0.01, atol=0.01)


@pytest.mark.parametrize("joint", JOINTS)
def test_an_elastic_joint_is_seen_through(joint):
    hidden = BY_LABEL[f"joint_elasticity@{joint}"]
    rotor = Term(RotorInertia(joint), np.array([MOTOR_INERTIA]))
    motion = moved("with_human", hidden)
    terms = (MACHINE, PERSON, *FRICTION, rotor)
    without = misfit(motion, *terms)
    assert misfit(replace(motion, body=BOTH), *terms, hidden) < 0.4 * without
    at_once = replace(motion, load=Model((MACHINE, PERSON)).torque(motion))
    assert misfit(at_once, *terms, hidden) < 0.5 * without


def test_play_is_seen_through_away_from_where_the_load_changes_sign():
    hidden = BY_LABEL["backlash@hip"]
    rotor = Term(RotorInertia("hip"), np.array([MOTOR_INERTIA]))
    motion = moved("with_human", Term(hidden.effect, np.array([0.01])))
    motion = replace(motion, load=Model((MACHINE, PERSON)).torque(motion))
    terms = (MACHINE, PERSON, *FRICTION, rotor)
    # Below 10 N·m it is uncertain to which side the load pushes the link.
    near = np.convolve(np.abs(motion.load[:, 0]) < 10.0, np.ones(61), mode="same") > 0
    motion = replace(motion, valid=motion.valid & ~near)
    assert misfit(motion, *terms, Term(hidden.effect, np.array([0.01]))) < 0.3 * misfit(
        motion, *terms
    )


@pytest.mark.parametrize("joint", JOINTS)
def test_a_limb_is_seen_to_move_against_its_cuff(joint):
    hidden = BY_LABEL[f"cuff_compliance@{joint}"]
    motion = moved("with_human", hidden)
    terms = (MACHINE, PERSON, *FRICTION)
    assert misfit(motion, *terms, hidden) < 0.4 * misfit(motion, *terms)
    swinging = replace(motion, limb_body=PERSON.values)
    assert misfit(swinging, *terms, hidden) < 0.15 * misfit(motion, *terms)
    unread = replace(motion, forces=None, load=Model((PERSON,)).torque(motion))
    assert misfit(unread, *terms, hidden) < 0.5 * misfit(unread, *terms)


def test_a_stiff_cuff_is_no_cuff():
    rigid = moved("with_human")
    stiff = moved("with_human", Term(BY_LABEL["cuff_compliance@knee"].effect, np.array([2e4])))
    inside = rigid.valid & stiff.valid
    # The machine's own small inertia beside the cuff, which the rigid leg has not, is all that is
    # left.
    assert_allclose(stiff.q[inside], rigid.q[inside], atol=1e-3)
    assert np.sqrt(np.mean((stiff.torque - rigid.torque)[inside] ** 2)) < 0.15


def test_a_human_effect_leaves_the_empty_machine_alone():
    empty = moved("exo_alone")
    for hidden in (t for t in TERMS if t.effect.side is Side.HUMAN and t.effect.joint == "knee"):
        assert hidden.effect.acts_in == RUNS[1:]
        assert_allclose(moved("exo_alone", hidden).torque, empty.torque)
