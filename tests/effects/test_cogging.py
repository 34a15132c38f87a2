"""A gear's ripple of up to four lines."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import Joint
from pipelines.effects.baseline import RigidBody
from pipelines.effects.cogging import Cogging
from pipelines.errors import InputError
from pipelines.export import JSON, C, Degree
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from pipelines.model import Model, Term, model_from_parameters, term_from
from pipelines.rig.plant import Plant, term_of
from pipelines.settings.rig.plant import PlantEffect, PlantSettings
from tests.effects.test_parameters_file import rows
from tests.export.machines import LEG, machine

TWO = {
    "amplitude": 1.5,
    "cycles_per_turn": 88.3,
    "phase": 0.6,
    "amplitude_2": 0.4,
    "cycles_per_turn_2": 201.7,
    "phase_2": -2.0,
}


@pytest.fixture
def two_lines():
    return term_from(Cogging("knee"), TWO)


def test_a_ripple_is_the_sum_of_its_lines(two_lines, with_human):
    knee = with_human.q[:, 1]
    expected = 1.5 * np.sin(88.3 * knee + 0.6) + 0.4 * np.sin(201.7 * knee - 2.0)
    torque = two_lines.effect.torque(with_human, two_lines.values)
    assert_allclose(torque[:, 1], expected, atol=1e-12)
    columns = two_lines.effect.columns(with_human, two_lines.shape)
    assert columns.shape == (len(knee), 2, 4)
    assert_allclose(columns @ two_lines.linear, torque, atol=1e-12)


def test_names_of_values_determine_the_number_of_lines():
    one = term_from(Cogging("knee"), {k: v for k, v in TWO.items() if not k.endswith("_2")})
    assert one.effect == Cogging("knee") and len(one.values) == 3
    assert [p.name for p in one.effect.parameters] == ["amplitude", "cycles_per_turn", "phase"]
    two = term_from(Cogging("knee"), TWO)
    assert two.effect.lines == 2 and two.effect.label == one.effect.label
    assert_allclose(two.effect.physical(two.values), list(TWO.values()))


@pytest.mark.parametrize("name", ["amplitude_5", "amplitude_1", "phase_2"])
def test_an_unknown_or_incomplete_line_is_refused(name):
    values = {k: v for k, v in TWO.items() if not k.endswith("_2")} | {name: 0.3}
    with pytest.raises(InputError, match=r"cogging@knee has values amplitude, .* expected"):
        term_from(Cogging("knee"), values)


def test_four_lines_survive_their_file(with_human):
    four = TWO | {
        f"{name}_{k}": value
        for k in (3, 4)
        for name, value in (("amplitude", 0.2 * k), ("cycles_per_turn", 90.1 * k), ("phase", 0.1))
    }
    body = Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7]))
    ripple = term_from(Cogging("knee"), four)
    table = pd.DataFrame(rows(body, "with_human") + rows(ripple))
    read = model_from_parameters(table, "with_human")
    assert_allclose(read.torque(with_human), Model((body, ripple)).torque(with_human), atol=1e-9)


def test_a_rig_may_hide_a_ripple_of_two_lines():
    told = PlantEffect(effect="cogging", joint="knee", values=TWO)
    plant = Plant(PlantSettings(effects=(told,)), "exo_alone")
    (ripple,) = (term for term in plant.model if term.effect.name == "cogging")
    assert ripple.effect.lines == 2
    assert_allclose(ripple.values, term_of(told, "here").values)


def test_both_lines_are_exported(two_lines):
    made = machine(*LEG, two_lines)
    (holding,) = (h for term, h in made.holdings(C) if term.effect.name == "cogging")
    assert holding.degree is Degree.EXACT
    written = C.write(made, "leg")[".c"]
    assert "knee_cogging_sine_2" in written and "knee_cogging_cycles_per_turn_2" in written
    assert '"amplitude_2"' in JSON.write(made, "leg")[".json"]


def test_lines_along_a_slide_are_counted_in_radians_a_metre():
    slide = machine_of([Joint("axis", "prismatic")], Geometry(gravity_m_s2=0.0))
    ripple = Cogging("axis", on=slide, lines=2)
    assert {p.unit for p in ripple.shape} == {"rad/m"}
    assert {p.unit for p in ripple.linear} == {"N"}


def test_intervals_of_each_line_are_its_own(two_lines):
    jacobian = two_lines.effect.jacobian(two_lines.values)
    first, second = [0, 1, 4], [2, 3, 5]
    assert_allclose(jacobian[:3, second], 0.0, atol=1e-6)
    assert_allclose(jacobian[3:, first], 0.0, atol=1e-6)
