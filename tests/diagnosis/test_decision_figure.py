"""The decision figure: every set once, most probable first, no words on top of each other."""

from dataclasses import replace
from itertools import pairwise

import pytest
from matplotlib import pyplot as plt

from pipelines.diagnosis.verdict.figures.decision import FAMILIES, _bars, figure
from pipelines.effects import Family
from tests.diagnosis.test_findings_in_words import ANGLE, COGGING, HUM, OFFSET, SPEED, diagnosed
from tests.report.sessions import checked_verdict, decision_of

SETS = {(SPEED, ANGLE): 0.5, (OFFSET, ANGLE): 0.3, (SPEED, HUM): 0.15, (COGGING,): 0.042, (): 0.008}


@pytest.fixture
def drawn():
    drawing = figure(diagnosed(SETS), checked_verdict(**decision_of()))
    yield drawing
    plt.close(drawing)


def test_the_bar_of_a_joint_is_cut_into_its_residuals_shares(drawn):
    shares = decision_of()["router"]["hip"]
    widths = [bar.get_width() for bar in drawn.axes[0].patches if bar.get_fill()]
    first, second = widths[: len(widths) // 2], widths[len(widths) // 2 :]
    assert first == pytest.approx(second)
    assert sum(first) == pytest.approx(1.0)
    wanted = [shares[part] for part in ("noise", "wanders", "between_runs", "repeats")]
    assert [width for width in first if width] == pytest.approx(wanted)


def test_what_is_there_with_a_person_only_is_marked_at_the_end_of_what_repeats(drawn):
    marks = [bar for bar in drawn.axes[0].patches if not bar.get_fill()]
    assert [(mark.get_x(), mark.get_width()) for mark in marks] == [
        (pytest.approx(0.9), pytest.approx(0.1))
    ] * 2


def test_bars_fall_and_with_that_of_all_others_they_add_up_to_one():
    bars = _bars(diagnosed(SETS))
    likely = [bar.probability for bar in bars]
    assert sum(likely) == pytest.approx(1.0)
    assert likely[:-1] == sorted(likely[:-1], reverse=True)
    assert bars[-1].elements[0][0] == "1 other set"


def test_it_is_said_where_most_of_the_other_sets_hold_the_first_and_more():
    certain = {(SPEED,): 0.98, (SPEED, OFFSET): 0.008, (SPEED, COGGING): 0.008, (): 0.004}
    words = " ".join(_bars(diagnosed(certain))[-1].elements[0][0].split())
    assert words == "3 other sets, mostly the first with a further cause or law"


def test_every_family_has_a_colour_of_its_own():
    assert set(FAMILIES) == {str(family) for family in Family}
    assert len(set(FAMILIES.values())) == len(FAMILIES)


def test_only_unlisted_laws_are_hatched(drawn):
    right = drawn.axes[2]
    hatched = [
        label.get_text()
        for label, bar in zip(right.get_yticklabels(), right.patches, strict=True)
        if bar.get_hatch()
    ]
    assert len(hatched) == 3
    assert all("law" in words or "tone" in words for words in hatched)


def test_labels_do_not_overlap(drawn):
    drawn.draw_without_rendering()
    for axis in drawn.axes:
        for labels in (axis.get_xticklabels(), axis.get_yticklabels()):
            boxes = [label.get_window_extent() for label in labels if label.get_text()]
            assert not any(a.overlaps(b) for a, b in pairwise(boxes))


def test_where_acquisition_is_at_fault_nothing_is_said_to_explain_it():
    d = diagnosed(SETS)
    d.selected = replace(d.selected, posterior=None)
    drawing = figure(d, checked_verdict(**decision_of() | {"posterior": None}))
    assert "acquisition is at fault" in drawing.axes[2].texts[0].get_text()
    plt.close(drawing)
