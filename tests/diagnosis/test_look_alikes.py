"""What only resembles a listed cause explains little of the error, and is called unlisted."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.look_alikes import listed_probability, with_look_alikes
from pipelines.diagnosis.selection.posterior import posterior
from tests.diagnosis.naming import naming
from tests.diagnosis.test_posterior import CRITERIA as OF_PROBLEM
from tests.diagnosis.test_posterior import problem
from tests.diagnosis.test_summary import LABEL, stuck  # noqa: F401 - a fixture


def test_the_more_of_the_error_a_cause_removes_the_more_likely_it_is_what_it_is_called():
    shares = np.linspace(0.0, 1.0, 21)
    told = [listed_probability(share) for share in shares]
    assert told == sorted(told) and told[-1] > 0.9 and told[2] < 0.5
    doubting = replace(CRITERIA, look_alike=(0.0, 0.0))
    assert listed_probability(0.3, doubting) == 0.5


@pytest.mark.parametrize("removed", [0.1, 0.6, 1.0])
def test_a_look_alike_takes_from_the_cause_for_an_unlisted_law_of_its_family_and_joint(removed):
    before = posterior(problem(strength=0.1), OF_PROBLEM)
    after = with_look_alikes(before, {"spring@hip": removed})
    kept = before.marginals["spring@hip"] * listed_probability(removed)
    assert sum(after.by_labels.values()) == pytest.approx(1.0)
    assert after.nothing == pytest.approx(before.nothing)
    assert after.marginals["spring@hip"] == pytest.approx(kept)
    assert after.marginals["law:unlisted_angle@hip"] == pytest.approx(before.marginals["spring@hip"] - kept)
    for other in ("drag@hip", "ripple@hip", "law:speed@hip"):
        assert after.marginals[other] == pytest.approx(before.marginals[other])
    family = [any(e.family == "angle" for e in map(after.elements.__getitem__, chosen)) for chosen in after.sets]
    assert after.probabilities[family].sum() == pytest.approx(
        sum(p for labels, p in before.by_labels.items() if labels & {"spring@hip", "drag@hip", "ripple@hip"})
    )


@pytest.mark.parametrize(("removed", "named"), [(1.0, [LABEL]), (0.05, [])])
def test_a_spring_that_removes_little_is_an_unlisted_law_of_the_angle(stuck, removed, named):  # noqa: F811
    selected = naming(stuck, LABEL).selected.with_look_alikes({LABEL: removed})
    assert list(selected.answer.labels) == named
    (finding,) = selected.findings
    assert (finding.level, finding.joint, finding.family) == ("cause" if named else "family", "knee", "angle")
    assert selected.shows_unlisted == (not named)


def test_causes_that_remove_all_keep_nearly_all_of_their_probability(stuck):  # noqa: F811
    (one,) = stuck.named
    assert stuck.selected.removed[LABEL] > 0.9
    assert one.probability > 0.9
