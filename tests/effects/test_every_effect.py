"""What holds for every effect that is registered."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import Joint
from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import DQ, DTHETA, accelerations, workspace
from pipelines.effects import EFFECTS, Effect, Family, Side
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.outside import STATED
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from pipelines.model import Model, Term
from pipelines.wording.law import LAWS
from tests.effects.catalogue import SIZES, TERMS

BODY = Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7]))
FRICTION = tuple(Term(Friction(joint), np.array([2.0, 3.0])) for joint in ("hip", "knee"))

BASELINE = ("rigid_body", "friction")


def every(terms):
    return pytest.mark.parametrize("term", list(terms), ids=lambda term: term.effect.label)


def test_every_effect_is_in_the_catalogue_of_these_tests():
    assert {effect.name for effect in EFFECTS} == set(SIZES)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_effect_says_what_it_is_and_how_to_make_sure(effect):
    assert all(str(getattr(effect, name)).strip() for name in STATED)
    for parameter in effect().fitted + effect().parameters:
        assert parameter.name and parameter.unit and parameter.meaning and parameter.symbol
        assert parameter.typical[0] < parameter.typical[1]
        assert parameter.default is None or parameter.default in (
            parameter.forms or (parameter.default,)
        )
    defaults = [parameter.default is not None for parameter in effect().fitted]
    assert defaults == sorted(defaults), "values that may be left out come last"


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_effect_states_its_family_the_laws_that_contain_it_and_how_the_real_one_differs(
    effect,
):
    assert "family" in vars(effect) and isinstance(effect.family, Family)
    assert effect.resembles and set(effect.resembles) <= set(LAWS)
    assert len(set(effect.resembles)) == len(effect.resembles)
    assert effect.forms_differ and not effect.forms_differ.endswith(".")


@pytest.mark.parametrize(
    ("side", "family", "laws"),
    [
        (Side.STRUCTURE, Family.ANGLE, ("angle", "both_angles")),
        (Side.DRIVE, Family.SPEED, ("speed",)),
        (Side.SENSOR, Family.SENSOR, ("angle", "load")),
        (Side.HUMAN, Family.PERSON, ("angle", "both_angles", "speed")),
    ],
)
def test_an_effect_that_states_no_family_has_that_of_its_side(side, family, laws):
    silent = type("Silent", (Effect,), {"side": side})
    assert (silent.family, silent.resembles, silent.forms_differ) == (family, laws, "")
    told = type("Told", (Effect,), {"side": side, "family": Family.TIME})
    assert told.resembles == ("time", "friction_over_time")


@every(TERMS)
def test_torque_is_linear_in_the_linear_parameters(term, with_human):
    twice = np.append(2.0 * term.linear, term.shape)
    assert_allclose(
        term.effect.torque(with_human, twice),
        2.0 * term.effect.torque(with_human, term.values),
        atol=1e-9,
    )
    assert_allclose(
        term.effect.columns(with_human, term.shape) @ term.linear,
        term.effect.torque(with_human, term.values),
        atol=1e-9,
    )


@every(t for t in TERMS if t.effect.parity is not None)
def test_torque_has_the_declared_parity_in_velocity(term, with_human):
    there = term.effect.columns(with_human, term.shape)
    back = term.effect.columns(replace(with_human, dq=-with_human.dq), term.shape)
    assert np.abs(there).max() > 0.0
    assert_allclose(back, term.effect.parity * there, atol=1e-9)


@every(t for t in TERMS if t.effect.dissipative)
def test_a_dissipative_effect_never_feeds_energy_into_the_joint(term, with_human):
    power = np.sum(term.effect.torque(with_human, term.values) * with_human.dq, axis=1)
    assert power.max() > 0.0
    assert power.min() >= 0.0


@every(
    t
    for t in TERMS
    if t.effect.joint
    and (t.effect.side is not Side.STRUCTURE or t.effect.name == "parallel_spring")
)
def test_an_effect_at_a_joint_touches_no_other(term, with_human):
    other = 1 - with_human.joint_index(term.effect.joint)
    assert not term.effect.columns(with_human, term.shape)[:, other].any()
    torques = np.stack([with_human.torque, -with_human.torque], axis=2)
    assert_allclose(
        term.effect.observed(torques, with_human, term.shape)[:, other], torques[:, other]
    )
    assert_allclose(
        term.effect.corrected(with_human, term.shape).q[:, other], with_human.q[:, other]
    )


@every(t for t in TERMS if t.effect.joint == "hip" and t.effect.inertial)
def test_mass_of_the_thigh_burdens_the_hip_alone(term, with_human):
    assert not term.effect.columns(with_human, term.shape)[:, 1].any()


@every(t for t in TERMS if t.effect.side is Side.HUMAN)
def test_a_human_effect_is_not_there_without_the_human(term, exo_alone, with_human):
    model = Model((BODY, *FRICTION, term))
    assert_allclose(model.torque(exo_alone), Model((BODY, *FRICTION)).torque(exo_alone))
    assert len(model.for_run("exo_alone").terms) == 3
    body = Term(RigidBody(run="with_human"), BODY.values)
    changed = Model((body, *FRICTION, term)).torque(with_human) - Model((body, *FRICTION)).torque(
        with_human
    )
    assert np.abs(changed).max() > 0.05


@every(
    t
    for t in TERMS
    if t.effect.reaction and not t.effect.states and t.effect.name not in ("rigid_body", "friction")
)
def test_forward_dynamics_undo_inverse_dynamics(term, with_human):
    """Columns and plant evaluate the same kernel: the predicted torque leads back to the
    acceleration."""
    model = Model((BODY, *FRICTION, term))
    torque, load = model.torque(with_human), with_human.transmitted[0]
    a, w = assemble(model, with_human.geometry), workspace(2)
    rates, memory = np.zeros((4, 2)), np.zeros(0)
    for k in range(3, len(with_human), 97):
        q, dq = with_human.q[k], with_human.dq[k]
        state = np.array([q, dq, q, dq])
        a.temperature[:] = with_human.interpolated_temperature[k]
        accelerations(
            a, w, with_human.time[k], state, memory, np.sign(dq), load[k], torque[k], rates
        )
        assert_allclose(rates[[DQ, DTHETA]], [with_human.ddq[k]] * 2, atol=1e-8)


@every(t for t in TERMS if t.effect.reading)
def test_the_corrected_angle_is_the_one_before_the_encoder(term, with_human):
    angles = with_human.q.copy()
    for angle in angles:
        term.effect.reading(angle, term.values, term.effect.column(with_human))
    assert np.abs(angles - with_human.q).max() > 0.01
    measured = replace(with_human, q=angles)
    assert_allclose(term.effect.corrected(measured, term.shape).q, with_human.q, atol=1e-12)


@every(t for t in TERMS if t.effect.torque_reading)
def test_delivered_torque_follows_from_measured_torque(term, with_human):
    body = Model((BODY, *FRICTION[1:]))
    model = Model((*body.terms, term))
    true, measured = body.torque(with_human), model.torque(with_human)
    assert np.abs(measured - true)[50:].max() > 0.2
    found = model.delivered(replace(with_human, torque=measured))
    # At the very end a late channel has not yet told what was delivered; sgn steps it draws out
    # over a sample.
    close = np.abs(found - true) < 0.02
    assert close[:-10].mean() > 0.99


@every(TERMS)
def test_files_and_fits_can_be_translated_into_one_another(term):
    effect = term.effect
    physical = effect.physical(term.values)
    assert len(physical) == len(effect.parameters)
    assert_allclose(effect.values_from(physical), term.values, rtol=1e-12)
    step = 1e-4 * np.maximum(np.abs(term.values), 1e-3)
    expected = effect.physical(term.values + step) - physical
    assert_allclose(effect.jacobian(term.values) @ step, expected, rtol=1e-3, atol=1e-9)


def test_values_left_out_have_their_defaults(with_human):
    (term,) = (t for t in TERMS if t.effect.label == "stribeck_friction@knee")
    short = Term(term.effect, term.values[:2])
    assert_allclose(short.values, [*term.values[:2], 2.0])
    assert_allclose(
        term.effect.columns(with_human, (0.15,)), term.effect.columns(with_human, (0.15, 2.0))
    )


def test_sensors_act_on_what_comes_before_them_and_not_on_the_measured_torque(with_human):
    by_name = {t.effect.label: t for t in TERMS}
    gain, offset = by_name["torque_gain@knee"], by_name["torque_offset@knee"]
    alone = Model((BODY,)).torque(with_human)[:, 1]
    assert_allclose(Model((gain, offset, BODY)).torque(with_human)[:, 1], 1.15 * alone + 1.5)
    assert_allclose(Model((offset, gain, BODY)).torque(with_human)[:, 1], 1.15 * (alone + 1.5))


def test_a_columns_place_in_the_regressor_is_its_terms(with_human):
    by_name = {t.effect.label: t for t in TERMS}
    terms = (
        by_name["torque_offset@hip"],
        BODY,
        by_name["torque_gain@knee"],
        by_name["parallel_spring@knee"],
    )
    model = Model(terms)
    names = [parameter.name for _, parameter in model.linear_parameters]
    regressor = model.regressor(with_human)
    assert names == ["offset", "X1", "X2", "X3", "X4", "stiffness", "preload"]
    assert_allclose(regressor[:, 0, 0], 1.0)
    assert_allclose(regressor[:, 1, 5], 1.15 * with_human.q[:, 1])


def test_a_delay_is_a_shift_in_time(with_human):
    (late,) = (t for t in TERMS if t.effect.label == "time_delay@hip")
    smooth = np.sin(3.0 * with_human.time)[:, np.newaxis, np.newaxis] * np.ones((1, 2, 1))
    observed = late.effect.observed(smooth, with_human, (0.0175,))[:, 0, 0]
    assert_allclose(observed[10:], np.sin(3.0 * (with_human.time[10:] - 0.0175)), atol=1e-4)


def test_a_delay_starts_again_after_a_gap(with_human):
    (late,) = (t for t in TERMS if t.effect.label == "time_delay@hip")
    halves = replace(with_human, segment=(np.arange(len(with_human)) >= 1000).astype(np.int64))
    steps = np.where(halves.segment == 0, -5.0, 5.0)[:, np.newaxis, np.newaxis] * np.ones((1, 2, 1))
    assert_allclose(late.effect.observed(steps, halves, late.shape), steps)


def test_a_mass_across_the_axis_is_one_along_it_a_right_angle_ahead(with_human):
    """The shank with moments X3 along and Y3 across is a shank with moment R along, turned by
    atan(Y3 / X3)."""
    across = next(t.effect for t in TERMS if t.effect.label == "mass_off_axis@knee")
    X3, Y3 = 1.5, 0.4
    turn = np.arctan2(Y3, X3)
    found = Model(
        (Term(RigidBody(), np.array([0, 0, X3, 0.0])), Term(across, np.array([Y3])))
    ).torque(with_human)
    turned = with_human.with_state(
        with_human.q + np.array([0.0, turn]), with_human.dq, with_human.ddq
    )
    expected = Model((Term(RigidBody(), np.array([0, 0, np.hypot(X3, Y3), 0.0])),)).torque(turned)
    assert_allclose(found, expected, atol=1e-12)


def test_a_payload_is_a_point_mass(with_human):
    """0.9 kg at 0.25 m below the knee, from Lagrange's equations of two links of lumped mass."""
    payload = next(t.effect for t in TERMS if t.effect.label == "payload_change@knee")
    m, r, L = 0.9, 0.25, with_human.geometry.thigh_length_m
    X = np.array([m * (L**2 + r**2), m * r**2, m * r, m * L])
    found = Term(payload, np.array([m * r, 5.0, r])).effect.torque(
        with_human, np.array([m * r, 5.0, r])
    )
    late = with_human.time >= 5.0
    assert not found[~late].any()
    assert_allclose(found[late], RigidBody().torque(with_human, X)[late], atol=1e-12)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_confirm_holds_no_unit_of_one_kind_or_size_of_machine(effect):
    assert not re.search(r"\brad|\bN·m", effect.confirm)


def test_of_a_spring_where_gravity_is_out_a_level_is_asked_for_and_nothing_laid_on_its_side():
    """An axis that leans lets gravity do nearly what a spring does."""
    turntable, pendulum = (
        machine_of([Joint("axis")], Geometry(gravity_m_s2=g)) for g in (0.0, 9.81)
    )
    assert ParallelSpring("axis", on=turntable).confirm.startswith(
        "put a spirit level on the axis first"
    )
    assert ParallelSpring("axis", on=pendulum).confirm == ParallelSpring.confirm
