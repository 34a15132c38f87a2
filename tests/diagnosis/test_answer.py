"""What is named, what is tied, and at which depth something is known, read off a posterior."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pipelines.diagnosis.selection.answer import answer_of
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.findings import findings
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.diagnosis.selection.selection import Selection


def cause(name: str, joint: str, family: str) -> Element:
    return Element(f"{name}@{joint}", name, joint, family, False, [0], [1.0])


def law(kind: str, joint: str, family: str, repeats: bool = True) -> Element:
    label = f"law:{kind}@{joint}"
    return Element(label, kind, joint, family, True, [0], [1.0], repeats=repeats)


SPRING = cause("parallel_spring", "knee", "angle")
STOP = cause("end_stop", "knee", "angle")
DRAG = cause("quadratic_drag", "hip", "speed")
PEAK = cause("stribeck_friction", "hip", "speed")
ANGLE = law("angle", "knee", "angle")
TIME = law("time", "hip", "time", repeats=False)
ELEMENTS = (SPRING, STOP, DRAG, PEAK, ANGLE, TIME)


def weighed(**sets: float) -> Posterior:
    """Return the posterior of sets named by their elements' numbers, as ``_02``."""
    chosen = {tuple(int(c) for c in name[1:]): p for name, p in sets.items()}
    order = sorted(chosen, key=lambda s: -chosen[s])
    p = np.array([chosen[s] for s in order])
    return Posterior(ELEMENTS, tuple(order), np.log(p))


def test_a_likely_cause_is_named_and_a_rival_that_is_not_far_behind_is_tied():
    posterior = weighed(_2=0.7, _3=0.25, _=0.03, _4=0.02)
    answer = answer_of(posterior)
    (named,) = answer.named
    assert named.element.label == "quadratic_drag@hip"
    assert dict(named.ties) == pytest.approx({"stribeck_friction@hip": 0.25})
    assert named.probability == pytest.approx(0.95)
    (finding,) = findings(posterior, answer)
    assert finding.level == "cause"
    assert [level for level, _, _ in finding.path] == [
        "missing",
        "repeats",
        "joint",
        "family",
        "cause",
    ]


def test_ties_are_named_that_are_likely_together_though_each_is_less_probable_than_nothing():
    (named,) = answer_of(weighed(_=0.3, _2=0.28, _3=0.25, _0=0.17)).named
    assert named.element.label == "quadratic_drag@hip"
    assert dict(named.ties).keys() == {"stribeck_friction@hip", "parallel_spring@knee"}
    assert (named.probability, named.alone) == (pytest.approx(0.7), pytest.approx(0.28))
    assert answer_of(weighed(_=0.55, _2=0.2, _3=0.15, _0=0.1)).named == ()
    assert answer_of(weighed(_=0.3, _4=0.3, _2=0.28, _5=0.12)).named == ()


def test_inseparable_causes_that_are_each_likely_are_ties_and_not_both_named():
    # Each is in more than half of the sets, as a few sets have both.
    (named,) = answer_of(weighed(_2=0.48, _3=0.46, _23=0.06)).named
    assert named.members == {"quadratic_drag@hip", "stribeck_friction@hip"}
    assert named.probability == pytest.approx(1.0)
    # Where most sets have both, both are missing.
    assert len(answer_of(weighed(_2=0.25, _3=0.2, _23=0.55)).named) == 2


def test_ties_that_are_likely_next_to_a_sure_cause_or_law_are_named_too():
    beside_law = answer_of(weighed(_4=0.3, _24=0.28, _34=0.25, _04=0.17)).named
    assert [one.members for one in beside_law] == [
        {"quadratic_drag@hip", "stribeck_friction@hip", "parallel_spring@knee"}
    ]
    drag, second = answer_of(weighed(_2=0.3, _02=0.27, _12=0.26, _=0.17)).named
    assert drag.members == {"quadratic_drag@hip"}
    assert second.members == {"parallel_spring@knee", "end_stop@knee"}
    assert second.probability == pytest.approx(0.53)


def test_a_third_cause_next_to_the_named_one_is_no_tie():
    posterior = weighed(_2=0.5, _02=0.4, _=0.1)
    (named,) = answer_of(posterior).named
    assert named.ties == ()
    assert named.probability == pytest.approx(0.9)


def test_what_most_sets_have_is_named_though_the_most_probable_set_lacks_it():
    apart = weighed(_2=0.35, _02=0.3, _025=0.25, _=0.1)
    assert [one.element.label for one in answer_of(apart).named] == [
        "quadratic_drag@hip",
        "parallel_spring@knee",
    ]
    rare = weighed(_2=0.5, _02=0.2, _025=0.2, _=0.1)
    assert [one.element.label for one in answer_of(rare).named] == ["quadratic_drag@hip"]


def test_two_causes_are_named_each_with_its_own_ties():
    posterior = weighed(_02=0.6, _12=0.3, _0=0.05, _2=0.05)
    named = {one.element.label: one for one in answer_of(posterior).named}
    assert set(named) == {"parallel_spring@knee", "quadratic_drag@hip"}
    assert dict(named["parallel_spring@knee"].ties).keys() == {"end_stop@knee"}
    assert named["quadratic_drag@hip"].ties == ()


def test_an_unlisted_law_is_a_finding_of_its_family_with_the_closest_causes():
    posterior = weighed(_4=0.6, _0=0.3, _1=0.07, _=0.03)
    answer = answer_of(posterior)
    assert answer.named == ()
    assert answer.unlisted == pytest.approx(0.6)
    (finding,) = findings(posterior, answer)
    assert (finding.level, finding.joint, finding.family) == ("family", "knee", "angle")
    assert finding.probability == pytest.approx(0.97)
    assert finding.causes[0] == ("parallel_spring@knee", pytest.approx(0.3))


def test_a_cause_and_an_unlisted_remainder_are_reported_together():
    posterior = weighed(_25=0.9, _2=0.1)
    answer = answer_of(posterior)
    reported = findings(posterior, answer)
    assert [one.element.label for one in answer.named] == ["quadratic_drag@hip"]
    assert {(one.level, one.family) for one in reported} == {("cause", "speed"), ("family", "time")}
    assert next(one for one in reported if one.family == "time").repeats is False


def test_a_law_of_the_same_family_as_the_named_cause_is_reported_with_it():
    posterior = weighed(_04=0.8, _0=0.2)
    cause, rest = sorted(findings(posterior, answer_of(posterior)), key=lambda one: one.level)
    assert (cause.level, cause.causes[0][0]) == ("cause", "parallel_spring@knee")
    assert (rest.level, rest.family, rest.probability) == ("family", "angle", pytest.approx(0.8))
    assert rest.laws == (("law:angle@knee", pytest.approx(0.8)),)
    assert rest.causes == ()


def test_what_may_stand_in_the_place_of_a_named_cause_is_no_second_finding():
    posterior = weighed(_0=0.55, _4=0.45)
    (finding,) = findings(posterior, answer_of(posterior))
    assert finding.level == "cause"


def test_a_rest_of_which_only_the_joint_is_known_is_reported_with_the_named_cause():
    posterior = weighed(_02=0.35, _05=0.35, _0=0.3)
    reported = findings(posterior, answer_of(posterior))
    assert [(one.level, one.joint) for one in reported] == [("cause", "knee"), ("joint", "hip")]
    assert reported[1].probability == pytest.approx(0.7)


def test_where_families_are_in_doubt_the_joint_is_reported_and_else_whether_it_repeats():
    joint = weighed(_2=0.3, _3=0.05, _5=0.4, _=0.25)
    (finding,) = findings(joint, answer_of(joint))
    assert (finding.level, finding.joint) == ("joint", "hip")
    two_joints = weighed(_4=0.35, _3=0.02, _2=0.25, _=0.38)
    (finding,) = findings(two_joints, answer_of(two_joints))
    assert (finding.level, finding.repeats) == ("repeatability", True)
    split = weighed(_4=0.3, _5=0.3, _=0.4)
    (finding,) = findings(split, answer_of(split))
    assert (finding.level, finding.repeats) == ("repeatability", None)
    assert finding.probability == pytest.approx(0.6)


def test_nothing_missing_has_no_findings():
    posterior = weighed(_=0.8, _2=0.2)
    assert findings(posterior, answer_of(posterior)) == []


def after(posterior, ratios):
    """Return what is selected after validation, given log likelihood ratios of named causes by
    label."""
    selected = Selection(None, None, posterior, posterior, answer_of(posterior), (), ())
    while harm := selected.worst_harm(ratios):
        selected = selected.judged(harm, harms=True)
    return selected


def test_validation_lowers_a_cause_that_harms_and_raises_none():
    posterior = weighed(_02=0.95, _0=0.05)
    answer = answer_of(posterior)
    helped = after(posterior, {"parallel_spring@knee": 40.0, "quadratic_drag@hip": 9.0}).answer
    assert [one.probability for one in helped.named] == [one.probability for one in answer.named]
    harmed = after(posterior, {"parallel_spring@knee": 40.0, "quadratic_drag@hip": -6.0}).answer
    assert [one.element.label for one in harmed.named] == ["parallel_spring@knee"]
    doubted = after(posterior, {"quadratic_drag@hip": -1.0}).answer
    (drag,) = [one for one in doubted.named if one.element.label == "quadratic_drag@hip"]
    odds = np.exp(-1.0) * 0.95 / 0.05
    assert drag.probability == pytest.approx(odds / (1.0 + odds))


def test_a_cause_stays_named_though_the_sets_that_held_it_held_one_that_harms():
    selected = after(weighed(_02=0.9, _0=0.01, _=1e-6), {"quadratic_drag@hip": -20.0})
    assert [one.element.label for one in selected.answer.named] == ["parallel_spring@knee"]
    assert selected.dropped == {"quadratic_drag@hip"}


def test_where_all_that_was_named_harms_nothing_may_be_missing():
    selected = after(weighed(_2=0.97, _=0.03), {"quadratic_drag@hip": -9.0})
    assert selected.answer.named == () and selected.answer.nothing > 0.99


@pytest.mark.parametrize("harm", [-0.5, -1.0, -1.3, -2.0, -6.0])
def test_what_is_named_and_the_findings_have_the_same_probabilities_after_validation(harm):
    """Two causes that harm a little each are as doubtful as the path to them."""
    selected = after(
        weighed(_02=0.9, _=0.1), {"parallel_spring@knee": harm, "quadratic_drag@hip": harm}
    )
    assert bool(selected.answer.named) == (selected.answer.nothing < 0.5)
    reported = [one for one in selected.findings if one.level == "cause"]
    assert [one.probability for one in reported] == [
        one.probability for one in selected.answer.named
    ]
    for one in reported:
        likely = [p for _, _, p in one.path]
        assert all(below <= above + 1e-12 for above, below in pairwise(likely))


ONCE, EVERY = (
    cause("encoder_offset", "hip", "angle"),
    replace(cause("encoder_offset", "hip", "angle"), each_run=True, sized_each_run=True),
)
TILT, WORN = (
    cause("base_tilt", "hip", "angle"),
    replace(cause("base_tilt", "hip", "angle"), worn=True),
)


def of(elements, **sets):
    return replace(weighed(**sets), elements=elements)


def test_a_zero_of_each_run_takes_the_place_of_one_for_all_runs_that_harms():
    posterior = of((ONCE, EVERY), _0=0.9, _1=0.08, _=0.02)
    (named,) = after(posterior, {"encoder_offset@hip": -20.0}).answer.named
    assert named.element is EVERY
    assert named.probability == pytest.approx(0.8)
    assert after(posterior, {"encoder_offset@hip": 20.0}).answer.named[0].element is ONCE


def test_a_tie_with_a_zero_of_each_run_is_named_instead_of_the_cause_that_harms():
    posterior = of((ONCE, EVERY, TILT), _2=0.6, _0=0.3, _1=0.08, _=0.02)
    assert answer_of(posterior).named[0].element is TILT
    selected = after(posterior, {"base_tilt@hip": -20.0})
    (named,) = selected.answer.named
    assert named.element is EVERY and named.ties == ()
    assert selected.posterior.marginals["encoder_offset@hip"] == pytest.approx(named.probability)


def test_what_the_person_carries_does_not_take_the_place_of_what_the_machine_has():
    posterior = of((TILT, WORN), _0=0.7, _1=0.28, _=0.02)
    assert after(posterior, {"base_tilt@hip": -20.0}).answer.named == ()


def test_sets_stay_in_the_order_of_their_probability():
    judged = weighed(_2=0.7, _3=0.25, _=0.05).judged({"quadratic_drag@hip": -10.0})
    assert judged.sets == ((3,), (), (2,))
    assert judged.probabilities.sum() == pytest.approx(1.0)


def test_what_takes_the_place_of_a_cause_that_harms_is_a_finding_and_its_ties_are_refuted_with_it():
    tied = after(weighed(_2=0.7, _3=0.2, _4=0.02, _=0.01), {"quadratic_drag@hip": -10.0})
    assert tied.answer.named == () and tied.posterior.marginals["stribeck_friction@hip"] < 0.01, (
        "ties do harm too"
    )
    other = after(weighed(_2=0.7, _0=0.05, _4=0.02, _=0.01), {"quadratic_drag@hip": -10.0})
    assert other.answer.named == () and other.posterior.marginals["parallel_spring@knee"] > 0.6
    assert [one.joint for one in other.findings] == ["knee"]
    assert other.dropped == {"quadratic_drag@hip"}


def test_a_tie_that_predicts_the_validation_runs_better_is_named_instead():
    posterior = weighed(_2=0.7, _3=0.25, _=0.05)
    selected = Selection(None, None, posterior, posterior, answer_of(posterior), (), ())
    judged = selected.judged({"quadratic_drag@hip": -4.0, "stribeck_friction@hip": 0.0})
    (named,) = judged.answer.named
    assert named.element is PEAK and named.members == {"stribeck_friction@hip"}
    assert named.probability == pytest.approx(0.95 * 0.25 / (0.25 + 0.7 * np.exp(-4.0))), (
        "it has what they had together"
    )
    assert judged.dropped == frozenset(), "the other does no harm"


def test_a_cause_named_with_one_that_harms_keeps_its_probability_and_so_do_all_above_it():
    """Without the one that harms, sets without either explain the training runs better."""
    selected = after(weighed(_02=0.9, _0=1e-6, _4=0.1, _=1e-8), {"quadratic_drag@hip": -30.0})
    (named,) = selected.answer.named
    assert named.element is SPRING and named.probability == pytest.approx(0.9, abs=1e-3)
    assert selected.posterior.marginals["law:angle@knee"] == pytest.approx(0.1, abs=0.01)
    (finding,) = [one for one in selected.findings if one.level == "cause"]
    assert all(p >= 0.9 - 1e-3 for _, _, p in finding.path)
    assert selected.posterior.probabilities.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("harm", [-1e-6, -0.2])
def test_a_little_harm_takes_a_little(harm):
    posterior = weighed(_02=0.9, _0=1e-6, _4=0.1, _=1e-8)
    selected = after(posterior, {"quadratic_drag@hip": -30.0, "parallel_spring@knee": harm})
    (named,) = selected.answer.named
    odds = 9.0 * np.exp(harm)
    assert named.probability == pytest.approx(odds / (1.0 + odds), abs=0.01)


def test_what_is_certain_stays_so_when_another_cause_is_refuted():
    sets = ((0, 2), (0,), (4,), ())
    certain = Posterior(ELEMENTS, sets, np.array([100.0, 40.0, 38.0, 0.0]))
    (named,) = after(certain, {"quadratic_drag@hip": -80.0}).answer.named
    assert named.element is SPRING and named.probability > 0.999999


def test_of_three_causes_the_two_that_do_no_harm_stay_named():
    posterior = weighed(_023=0.9, _02=1e-3, _0=1e-3, _2=1e-5, _3=0.05, _=0.01, _5=0.04)
    selected = after(posterior, {"stribeck_friction@hip": -40.0})
    assert {one.element.label for one in selected.answer.named} == {
        "parallel_spring@knee",
        "quadratic_drag@hip",
    }
    assert all(one.probability > 0.89 for one in selected.answer.named)


def test_ties_that_are_likely_together_stay_named_though_none_is_as_probable_as_nothing():
    posterior = weighed(_2=0.3, _3=0.2, _0=0.18, _=0.25, _4=0.07)
    selected = Selection(None, None, posterior, posterior, answer_of(posterior), (), ())
    assert selected.answer.named[0].members == {
        "quadratic_drag@hip",
        "stribeck_friction@hip",
        "parallel_spring@knee",
    }
    judged = selected.judged(
        {"quadratic_drag@hip": -0.4, "stribeck_friction@hip": 0.0, "parallel_spring@knee": 0.0}
    )
    (named,) = judged.answer.named
    assert named.alone < judged.answer.nothing
    assert named.probability == pytest.approx(0.68, abs=0.01)


def test_a_tie_that_won_is_charged_when_it_harms():
    posterior = weighed(_2=0.7, _3=0.25, _=0.05)
    selected = Selection(None, None, posterior, posterior, answer_of(posterior), (), ())
    won = selected.judged({"quadratic_drag@hip": -4.0, "stribeck_friction@hip": 0.0})
    harm = won.worst_harm({"stribeck_friction@hip": -50.0})
    assert harm == {"stribeck_friction@hip": -50.0}
    assert won.judged(harm, harms=True).answer.named == ()


@pytest.mark.parametrize("probability", [0.3, 0.999])
def test_a_floor_changes_no_ratio_within_the_sets_that_hold_the_group_or_lack_it(probability):
    before = weighed(_02=0.15, _0=0.05, _4=0.2, _=0.6)
    group = frozenset({"parallel_spring@knee"})
    raised = before.at_least(group, probability)
    p, was = raised.by_labels, before.by_labels
    assert raised.any_of(group) == pytest.approx(probability)
    both = group | {"quadratic_drag@hip"}
    assert p[group] / p[both] == pytest.approx(was[group] / was[both])
    assert p[frozenset()] / p[frozenset({"law:angle@knee"})] == pytest.approx(3.0)
    assert before.at_least(frozenset({"law:angle@knee"}), 0.1) is before, "it has more"
    assert before.at_least(frozenset({"base_tilt"}), 0.1) is before, "no set has it"


def test_two_causes_that_stand_for_one_are_no_ties_of_it():
    """Each of them explains a part; neither is a tie of the named one."""
    (named,) = answer_of(weighed(_0=0.5, _2=0.2, _45=0.3)).named
    assert [label for label, _ in named.ties] == ["quadratic_drag@hip"]


def test_equals_that_a_third_cause_may_join_stay_equals():
    """A set's probability of the named cause with a third one is the rival's with the third one."""
    (named,) = answer_of(weighed(_2=0.3, _02=0.15, _3=0.25, _03=0.2, _=0.1)).named
    assert dict(named.ties) == pytest.approx({"stribeck_friction@hip": 0.45})


def test_a_rival_is_held_against_all_that_speaks_for_the_named_cause():
    (named,) = answer_of(weighed(_2=0.36, _02=0.22, _12=0.22, _3=0.04, _=0.16)).named
    assert named.ties == ()
    assert named.probability == pytest.approx(0.8)
