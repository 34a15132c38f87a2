"""Learning raises the probability of the truth, and what it starts from comes back unchanged."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.prior import FEATURES, weights
from tests.campaigns.blind.splits import forms_by_fold
from tests.campaigns.learn.cross_validation import AWAY, away, parts
from tests.campaigns.learn.prior_fit import Sets
from tests.campaigns.learn.search import ascend
from tests.campaigns.learn.sensitivity import CHANGE, changes, score_and_share
from tests.campaigns.learn.truth import right_sets
from tests.campaigns.learn.vector import from_vector, names, to_vector


def sessions(count: int = 200) -> tuple[Sets, np.ndarray]:
    """Return sessions of a law, a cause and the empty set; the truth is a cause in one of
    four."""
    rng = np.random.default_rng(5)
    features = np.zeros((count, 3, len(FEATURES)))
    features[:, 1, FEATURES.index("cause")] = 1.0
    features[:, 2, FEATURES.index("law")] = 1.0
    truth = np.where(rng.random(count) < 0.25, 1, 0)
    evidence = np.zeros((count, 3))
    evidence[:, 1] = np.where(truth == 1, 4.0, -1.0) + rng.normal(size=count)
    return Sets(features, np.eye(3)[truth], np.full(count, 1.0 / count)), evidence


def test_the_vector_of_a_criterion_gives_the_same_criteria_back():
    again = from_vector(to_vector(CRITERIA), CRITERIA)
    assert len(names()) == len(to_vector(CRITERIA))
    assert weights(again).tolist() == weights(CRITERIA).tolist()
    np.testing.assert_allclose(to_vector(again), to_vector(CRITERIA))


def test_the_fitted_prior_gives_the_truth_more_probability_than_its_start():
    sets, evidence = sessions()
    start = weights(CRITERIA)
    fitted, score = sets.fit(evidence, start)
    assert score > sets.weights @ sets.scores(evidence, start)
    assert fitted[FEATURES.index("law")] < start[FEATURES.index("law")], "no law is ever the truth"


def test_coordinate_steps_come_close_to_a_maximum():
    best, value, _ = ascend(lambda x: (-float(np.sum((x - 1.0) ** 2)), x), np.zeros(3))
    assert value > -0.1
    np.testing.assert_allclose(best, 1.0, atol=0.2)


def test_each_number_is_changed_alone_and_by_the_same_factor():
    seen = {name: changed for name, *changed in changes(CRITERIA)}
    assert {*names(), *FEATURES} < set(seen)
    larger, smaller, _ = seen["shape_sd"]
    assert larger.shape_sd == pytest.approx(CHANGE * CRITERIA.shape_sd)
    assert smaller.shape_sd == pytest.approx(CRITERIA.shape_sd / CHANGE)
    np.testing.assert_allclose(
        weights(replace(larger, shape_sd=CRITERIA.shape_sd)), weights(CRITERIA)
    )
    assert seen["amplitudes[1]"][2].amplitudes == CRITERIA.amplitudes[:1]
    assert seen["further"][2].further == 0.0


def test_a_prior_that_forbids_causes_is_seldom_right_where_causes_are_the_truth():
    sets, evidence = sessions()
    score, share = score_and_share(sets, evidence, replace(CRITERIA, cause=-3.0))
    worse, seldom = score_and_share(sets, evidence, replace(CRITERIA, cause=-30.0))
    assert score > worse
    assert share > seldom
    assert seldom == pytest.approx(sets.weights @ sets.right[:, 0])


def hidden(effect, joint):
    return {"effect": effect, "joint": joint, "form": "plain"}


def truth(category, *causes):
    return {"case": {"category": category}, "hidden": list(causes)}


def test_a_set_is_right_where_it_holds_each_hidden_cause_and_nothing_else():
    both = right_sets(truth("pair", hidden("backlash", "knee"), hidden("payload_change", "hip")))
    assert both(frozenset({"backlash@knee", "payload_change@hip"}))
    assert not both(frozenset({"backlash@knee"}))
    assert not both(frozenset({"backlash@knee", "payload_change@hip", "law:angle@hip"}))
    assert right_sets(truth("none"))(frozenset())
    assert not right_sets(truth("imperfect"))(frozenset({"backlash@knee"}))


def test_a_cause_that_no_data_can_separate_from_the_hidden_one_is_as_right():
    offset = right_sets(truth("single", hidden("torque_offset", "knee")))
    assert offset(frozenset({"coulomb_asymmetry@knee"}))
    assert not offset(frozenset({"coulomb_asymmetry@hip"}))


def held(world, *forms):
    return SimpleNamespace(
        world=world, truth={"hidden": [{"effect": e, "form": f} for e, f in forms]}
    )


def test_each_world_and_each_fold_of_forms_is_left_out_once():
    (one, *_), (other, *_), _ = (sorted(forms) for forms in forms_by_fold())
    sessions = [
        held("planar", one),
        held("mujoco", other),
        held("mujoco", one, other),
        held("planar"),
    ]
    left_out = dict(parts(sessions))
    assert left_out["world planar"] == [sessions[0], sessions[3]]
    assert left_out["forms of fold 0"] == [sessions[0], sessions[2]]
    assert left_out["forms of fold 1"] == [sessions[1], sessions[2]]
    assert left_out["forms of fold 2"] == []


def test_learning_again_starts_from_nothing_that_was_learned():
    start = away(CRITERIA)
    np.testing.assert_allclose(to_vector(start) - to_vector(CRITERIA), np.log(AWAY))
    assert start.cause == start.law == start.further == 0.0
    assert start.model_error == CRITERIA.model_error, "held numbers are not learned"
