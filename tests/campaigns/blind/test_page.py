"""The page says what the records say, and whether its seeds may be reported."""

from dataclasses import replace

import pytest
from matplotlib import image
from typer import BadParameter

from tests.campaigns.blind.page import main, page
from tests.campaigns.blind.report import Examination, read, write
from tests.campaigns.blind.scoring import Score

PLAY, COGGING = ("backlash", "knee"), ("cogging", "hip")
SCORE = Score(
    seed=540_000,
    category="single",
    truth=(PLAY,),
    forms=("two_mass",),
    own_form=False,
    magnitude=0.1,
    visibility=0.8,
    kinds=("exo_alone", "with_human"),
    status="explained",
    named=(PLAY,),
    right=True,
    probabilities=((0.9, True),),
    rmse_over_floor={"hip": 1.0, "knee": 1.1},
    covered=(("backlash", "play", True),),
    seconds=4.0,
)
MISTAKEN = replace(
    SCORE, seed=540_001, named=(COGGING,), right=False, probabilities=((0.6, False),), covered=()
)
SILENT = replace(
    SCORE,
    seed=540_002,
    category="none",
    truth=(),
    forms=(),
    magnitude=None,
    status="nothing_missing",
    named=(),
    probabilities=(),
    covered=(),
)
HALF = replace(
    SCORE,
    seed=540_003,
    category="pair",
    truth=(PLAY, COGGING),
    magnitude=None,
    right=False,
    named=(PLAY,),
    covered=(),
)
STRANGE = replace(
    SCORE,
    seed=540_004,
    category="outside",
    truth=(("outside:tone", "hip"),),
    forms=("tone",),
    status="unknown_cause",
    named=(),
    probabilities=(),
    covered=(),
)
MIXED = Examination(
    "python -m tests.campaigns.blind --seeds reporting", [SCORE, MISTAKEN, SILENT, HALF, STRANGE]
)
STRANGERS = "Outside the catalogue"


def section(text, title):
    return text.split(f"## {title}\n")[1].split("\n## ")[0]


def test_a_record_reads_as_it_was_written(tmp_path):
    write(tmp_path, MIXED)
    assert read(tmp_path / "report.json") == MIXED


def test_the_page_sets_what_was_measured_next_to_what_was_asked_for():
    text = section(page([MIXED]), "Targets and measurements")
    assert (
        "| single: right cause and joint first | >= 93 % | 50.0 % of 2 (9 to 91) | **no** |" in text
    )
    assert "| false alarms, nothing hidden | <= 1 % | 0.0 % of 1 (0 to 79) | yes |" in text
    assert (
        "| outside the catalogue: called unlisted | >= 85 % | 100.0 % of 1 (21 to 100) | yes |"
        in text
    )
    assert "| data fault named |  | no cases |  |" in text
    # (0.1² + 0.6² + 0.1²) / 3
    assert "| Brier score | <= 0.06 | 0.127 | **no** |" in text


def test_the_page_says_that_seeds_were_never_tuned_on_only_where_that_is_so():
    assert "never tuned on" in page([MIXED])
    tuned = Examination(
        "python -m tests.campaigns.blind", [*MIXED.scores, replace(SCORE, seed=100_000)]
    )
    for text in (page([tuned]), page([MIXED, tuned])):
        assert "never tuned on" not in text
        assert "**Not a report" in text


def test_every_wrong_answer_is_listed_by_kind_and_not_by_seed():
    again = replace(MISTAKEN, seed=540_005)
    text = section(page([replace(MIXED, scores=[*MIXED.scores, again])]), "Every wrong answer")
    assert "| backlash@knee | cogging@hip 2 |" in text
    assert "| backlash@knee + cogging@hip | backlash@knee 1 |" in text
    assert "50000" not in text


def test_of_a_pair_one_may_be_named():
    assert "| one | 100.0 % of 1 (21 to 100) |" in section(page([MIXED]), "Pairs")


def test_singles_are_reported_by_the_examination_with_most_of_them_and_all_else_by_each():
    full = Examination(
        "python -m tests.campaigns.blind --full --seeds reporting",
        [replace(SCORE, seed=k) for k in (1, 2, 3)],
    )
    text = page([MIXED, full])
    by_cause, seconds, outside = (
        section(text, t) for t in ("By cause and joint", "Seconds a diagnosis", STRANGERS)
    )
    assert "Examination 2:\n\n|  | right | else |" in by_cause and "Examination 1" not in by_cause
    assert "Examination 1:" in seconds and "Examination 2:" in seconds
    assert "Examination 1:" in outside and "Examination 2:" not in outside


def test_a_page_of_machines_of_one_joint_says_so():
    slid = replace(MIXED, scores=[replace(s, machine="slide") for s in MIXED.scores])
    assert "machines of one joint" in page([slid]) and "machines of one joint" not in page([MIXED])
    assert "| slide | 50.0 % of 2 (9 to 91) |" in section(page([slid]), "By machine")


def test_only_the_remark_on_probabilities_shows_the_picture():
    text = page(
        [replace(MIXED, command="python -m tests.campaigns.blind --out {picture}")],
        "images/one.png",
    )
    assert "`python -m tests.campaigns.blind --out {picture}`" in text
    assert text.count("images/one.png") == 1 and "(images/one.png)" in section(
        text, "Reliability of the probabilities"
    )


@pytest.mark.parametrize("scores", [MIXED.scores, [SILENT]], ids=["mixed", "nothing was named"])
def test_the_page_and_its_picture_are_written_from_records(tmp_path, scores):
    write(tmp_path, replace(MIXED, scores=scores))
    main([tmp_path / "report.json"], tmp_path / "docs" / "blind.md")
    assert "(images/blind-reliability.png)" in (
        tmp_path / "docs" / "blind.md"
    ).read_text() or scores == [SILENT]
    picture = image.imread(tmp_path / "docs" / "images" / "blind-reliability.png")
    assert picture.std() > 0


def test_parts_of_an_examination_are_counted_together_and_no_case_twice():
    more = Examination("again", [replace(SCORE, seed=540_100), replace(MISTAKEN, seed=540_101)])
    text = page([MIXED, more], pooled=True)
    run = section(text, "What was run")
    assert f"`{MIXED.command}`" in run and "`again`" in run
    assert "as examination 1" in run and "as examination 1" not in page([MIXED, more])
    assert "Examination 2" not in text
    assert "| backlash@knee | 50.0 % of 4 (15 to 85) |" in section(text, "By cause and joint")
    with pytest.raises(BadParameter, match="would count twice"):
        page([MIXED, MIXED], pooled=True)
