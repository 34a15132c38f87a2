"""What only resembles a listed cause explains little of the error, and is called unlisted."""

import numpy as np
import pytest

from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior, posterior
from pipelines.diagnosis.selection.unlisted_look_alikes import kept_share, with_look_alikes
from tests.diagnosis.naming import naming
from tests.diagnosis.test_posterior import CRITERIA as OF_PROBLEM
from tests.diagnosis.test_posterior import cause, problem
from tests.diagnosis.test_summary import LABEL, stuck  # noqa: F401 - a fixture


def test_the_more_of_the_error_a_cause_removes_the_more_likely_it_is_what_it_is_called():
    shares = np.linspace(0.0, 1.0, 21)
    kept = kept_share(shares)
    assert (np.diff(kept) >= 0.0).all() and kept[-1] > 0.9 and kept[2] < 0.5
    assert kept_share(0.3, look_alike=(0.0, 0.0)) == 0.5
    assert kept_share(0.3, 0.2, look_alike=(0.0, 0.0)) == 0.7


@pytest.mark.parametrize("removed", [0.1, 0.6, 1.0])
def test_a_look_alike_takes_from_the_cause_for_an_unlisted_law_of_its_family_and_joint(removed):
    before = posterior(problem(strength=0.1), OF_PROBLEM)
    after = with_look_alikes(before, {frozenset({"spring@hip"}): removed})
    kept = before.marginals["spring@hip"] * kept_share(removed)
    assert sum(after.by_labels.values()) == pytest.approx(1.0)
    assert after.nothing == pytest.approx(before.nothing)
    assert after.marginals["spring@hip"] == pytest.approx(kept)
    assert after.marginals["law:unlisted_angle@hip"] == pytest.approx(
        before.marginals["spring@hip"] - kept
    )
    for other in ("drag@hip", "ripple@hip", "law:speed@hip"):
        assert after.marginals[other] == pytest.approx(before.marginals[other])
    family = [
        any(e.family == "angle" for e in map(after.elements.__getitem__, chosen))
        for chosen in after.sets
    ]
    assert after.probabilities[family].sum() == pytest.approx(
        sum(
            p
            for labels, p in before.by_labels.items()
            if labels & {"spring@hip", "drag@hip", "ripple@hip"}
        )
    )


def test_what_a_smooth_law_has_in_its_place_already_is_not_taken_from_the_cause_again():
    """A law of the hip's angle as probable as the spring: the look-alike would have a third of the
    spring's."""
    elements = (
        cause("spring", [0]),
        Element("law:angle@hip", "angle", "hip", "angle", True, [1], [1.0]),
    )
    even = Posterior(elements, ((0,), (1,), ()), np.array([5.0, 5.0, 0.0]))
    removed = {frozenset({"spring@hip"}): 0.2}
    assert kept_share(0.2) < 0.7
    assert with_look_alikes(even, removed).marginals == pytest.approx(even.marginals)
    rare = Posterior(elements, ((0,), (1,), ()), np.array([5.0, 3.0, 0.0]))
    after = with_look_alikes(rare, removed)
    unlisted = after.marginals["law:unlisted_angle@hip"] + after.marginals["law:angle@hip"]
    assert unlisted == pytest.approx((1.0 - kept_share(0.2)) * rare.marginals["spring@hip"])


@pytest.mark.parametrize(("removed", "named"), [(1.0, [LABEL]), (0.05, [])])
def test_a_spring_that_removes_little_is_an_unlisted_law_of_the_angle(stuck, removed, named):  # noqa: F811
    selected = naming(stuck, LABEL).selected.with_look_alikes({LABEL: removed})
    assert list(selected.answer.labels) == named
    (finding,) = selected.findings
    assert (finding.level, finding.joint, finding.family) == (
        "cause" if named else "family",
        "knee",
        "angle",
    )
    assert selected.shows_unlisted == (not named)


def test_causes_that_remove_all_keep_nearly_all_of_their_probability(stuck):  # noqa: F811
    (one,) = stuck.named
    assert stuck.selected.removed[LABEL] > 0.9
    assert one.probability > 0.9
