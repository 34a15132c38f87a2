"""Which column is which parameter, in which runs."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pipelines.effects import PassiveJointTorque, TorqueDrift, VoluntaryTorque
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import ParameterLayout, TermColumns, baseline

KINDS = ("exo_alone", "with_human", "with_human")
DRIFT, PUSH = TorqueDrift("hip"), VoluntaryTorque("knee")


@pytest.fixture
def layout():
    """A drift, whose level is each run's own, and a wearer's push, of which all is."""
    return ParameterLayout.of((*baseline(THE_LEG, ("exo_alone", "with_human")), DRIFT, PUSH), KINDS)


def test_a_parameter_that_differs_has_a_column_in_each_run_with_its_term(layout):
    *_, drift, push = layout.terms
    assert [term.width for term in layout.terms] == [4, 4, 2, 2, 1 + 3, 2 * 3]
    assert layout.size == 22
    assert [list(drift.places(run)) for run in range(3)] == [[12, 13], [12, 14], [12, 15]]
    assert [list(push.places(run)) for run in range(3)] == [[-1] * 3, [16, 17, 18], [19, 20, 21]]


def test_a_run_that_was_not_fitted_has_shared_columns_only(layout):
    assert list(layout.terms[-2].places(None)) == [12, -1]
    values = np.arange(22.0)
    assert_array_equal(layout.select(values, None)[-5:], [12.0, 0.0, 0.0, 0.0, 0.0])
    assert_array_equal(layout.per_run[-5:], [False, True, True, True, True])


def test_columns_in_their_places_predict_what_a_run_predicts_with_its_own_values(layout):
    draw = np.random.default_rng(0)
    values = draw.normal(size=layout.size)
    for run, kind in enumerate(KINDS):
        columns = draw.normal(size=(7, 2, 17))
        columns[:, :, 14:] *= kind == "with_human"
        expected = columns @ layout.select(values, run)
        np.testing.assert_allclose(layout.expand(columns, run) @ values, expected, atol=1e-12)


def test_columns_that_all_runs_share_are_left_as_they_are():
    shared = ParameterLayout.of(baseline(THE_LEG, ("exo_alone",)), KINDS)
    columns = np.ones((3, 2, shared.size))
    assert shared.expand(columns, 1) is columns


def test_a_run_that_lacks_a_term_has_none_of_its_own_columns():
    layout = ParameterLayout.of([DRIFT, PUSH], KINDS, absent=[(0, 1), (1, 2)])
    assert [term.runs for term in layout.terms] == [(0, 2), (1,)]
    assert layout.size == 1 + 2 + 3
    present = layout.expand(np.ones((1, 2)), 2, terms=[0])
    assert_array_equal(present, [[1.0, 0.0, 1.0, 0.0, 0.0, 0.0]])


def test_rigid_bodies_are_found_by_who_moves(layout):
    assert layout.bodies_in("exo_alone").tolist() == [[0, 1, 2, 3]]
    assert layout.bodies_in("with_human").tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]


def test_columns_are_known_by_name_and_by_the_kind_of_run_they_act_in(layout):
    names = [column.name for column in layout.columns]
    assert names[:5] == ["X1", "X2", "X3", "X4", "the person's X1"]
    assert names[8] == "hip coulomb"
    assert names[12] == "rate of torque_drift@hip"
    assert names[11] == "knee viscous"
    assert_array_equal(np.flatnonzero(~layout.acting_in("exo_alone")), [4, 5, 6, 7, *range(14, 22)])


def test_shapes_follow_all_columns_term_by_term():
    layout = ParameterLayout.of([PUSH, PassiveJointTorque("hip"), DRIFT], KINDS)
    ends = [(layout.shapes(term).start, layout.shapes(term).stop) for term in range(3)]
    first, second = len(PUSH.shape), len(PassiveJointTorque("hip").shape)
    assert ends == [
        (layout.size, layout.size + first),
        (layout.size + first, layout.size + first + second),
        (layout.size + first + second, layout.size + first + second),
    ]


def test_columns_of_another_meaning_than_a_terms_parameters_are_laid_out_alike():
    own = TermColumns.of(PUSH, KINDS, [True])
    columns = np.array([[3.0], [4.0]])
    assert_array_equal(own.expand(columns, 2), [[0.0, 3.0], [0.0, 4.0]])
