"""The first screen: it claims what the data say, ties included, and says it in a few words."""

import re

import pytest

from pipelines.contracts.verdict import Cause
from pipelines.report.html.report import report
from pipelines.report.sections.key_figures import tiles
from pipelines.report.session import find
from pipelines.wording.causes import causes_in_words, labels_in_words
from tests.report.sessions import AXIS, decision_of, verdict_of, write_session, write_verdict

FAULT = {"file": "run_1.parquet", "channel": "hip_angle_rad", "what": "the hip's angle is stuck"}


def cause(effect="cogging", joint="knee", ties=()):
    first = verdict_of()["causes"][0]
    shared = {"why": "", "how_to_separate": "", "probability": 0.1, "per_run": False}
    rivals = [{"effect": e, "joint": j} | shared for e, j in ties]
    return first | {"effect": effect, "joint": joint, "indistinguishable_from": rivals}


def checked(cause):
    return Cause.model_validate(cause)


@pytest.mark.parametrize(
    ("ties", "said"),
    [
        ([], "cogging at the knee"),
        ([("backlash", "knee")], "cogging or backlash at the knee"),
        ([("backlash", "hip")], "cogging at the knee or backlash at the hip"),
        ([("base_tilt", None)], "cogging at the knee or base tilt"),
        (
            [("backlash", "knee"), ("backlash", "hip")],
            "cogging at the knee or 2 others that these data cannot separate",
        ),
    ],
)
def test_the_headline_claims_no_cause_that_is_tied(ties, said):
    assert causes_in_words([checked(cause(ties=ties))]).startswith(said)


def test_a_tie_that_would_differ_from_run_to_run_is_called_so():
    tied = cause("torque_offset", ties=[("encoder_offset", "knee")]) | {
        "each_run": [{"file": "a", "purpose": "train", "values": {}, "ci95": {}}]
    }
    tied["indistinguishable_from"][0]["per_run"] = True
    assert (
        causes_in_words([checked(tied)])
        == "per-run torque offset or per-run encoder offset at the knee"
    )


def test_two_causes_are_parted_by_a_comma_where_one_of_them_is_tied():
    both = checked(cause()), checked(cause("backlash", "hip"))
    assert causes_in_words(both) == "cogging at the knee and backlash at the hip"
    tied = both[0], checked(cause("backlash", "hip", [("torque_offset", "hip")]))
    assert causes_in_words(tied) == "cogging at the knee, and backlash or torque offset at the hip"


def test_labels_in_a_sentence_are_said_in_words_and_longer_ones_are_not_cut():
    said = labels_in_words(
        "load@hip is not cogging@hip, nor base_tilt", ["cogging@hip", "base_tilt", "cogging"]
    )
    assert said == "load@hip is not cogging at the hip, nor base tilt"


def top(folder):
    page = report(find([folder]))
    return page[page.index('<section id="verdict"') : page.index('<section id="measured"')]


def test_bars_with_tied_causes_are_of_the_likeliest_and_say_so(tmp_path):
    folder = write_session(tmp_path / "leg")
    assert "with the likeliest cause" in top(folder)
    write_verdict(folder, causes=[cause()])
    assert "with the named cause" in top(folder)


def test_an_error_is_told_beside_the_torque_that_was_measured(tmp_path):
    folder = write_session(tmp_path / "leg")
    assert "measured" not in top(folder)
    write_verdict(folder, torque_rms_nm={"hip": 22.512, "knee": 12.25})
    assert "; measured" in top(folder) and "22.5" in top(folder)


def test_faults_of_acquisition_stand_below_a_lead_that_is_the_finding_alone(tmp_path):
    folder = write_session(tmp_path / "leg")
    write_verdict(
        folder,
        summary="Found. Guessed. Faulty.",
        finding="Found.",
        data_faults=[FAULT, FAULT, FAULT],
    )
    assert '<p class="lead">Found.</p>' in top(folder)
    assert (
        "3 faults of acquisition, the first: run_1.parquet, hip_angle_rad: the hip&#39;s"
        " angle" in top(folder)
    )
    assert 'href="#faults"' in top(folder)
    write_verdict(folder, finding="Found.", data_faults=[FAULT])
    assert "Also a fault of acquisition: run_1.parquet" in top(folder)
    assert 'href="#faults"' not in top(folder)


def test_a_verdict_of_an_older_version_leads_with_its_summary_and_tells_no_fault_twice(tmp_path):
    folder = write_session(tmp_path / "leg")
    write_verdict(folder, summary="Found. Faulty.", data_faults=[FAULT])
    assert '<p class="lead">Found. Faulty.</p>' in top(folder)
    assert "faults of acquisition" not in top(folder)


def gains(folder, *causes):
    write_verdict(folder, causes=causes)
    return [tile for tile in tiles(find([folder])) if tile.title.startswith("gain")]


def test_each_gain_says_what_it_is_of(tmp_path):
    folder = write_session(tmp_path / "leg")
    assert [tile.title for tile in gains(folder, cause(), cause("backlash"))] == [
        "gain of cogging at the knee",
        "gain of backlash at the knee",
    ]


def test_a_gain_is_of_the_error_that_the_other_causes_leave(tmp_path):
    folder = write_session(tmp_path / "leg")
    (alone,) = gains(folder, cause())
    assert (alone.big, alone.unit) == ("0.504", "N·m")
    assert alone.small == "0.818 → 0.314 N·m at the knee; 95 %: 0.450 … 0.550"
    of_two, _ = gains(
        folder, cause() | {"gain": cause()["gain"] | {"rmse_reduction_nm": 0.1}}, cause("backlash")
    )
    assert of_two.small.startswith("0.414 → 0.314 N·m at the knee, given the other causes;")


def text_of(part):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", part))


def test_the_path_and_the_three_cases_stand_on_the_first_screen(tmp_path):
    folder = write_session(tmp_path / "leg")
    shown = text_of(top(folder))
    assert "nothing 0.03" in shown
    assert "listed causes only 0.95" in shown
    assert "something unlisted 0.02" in shown
    path = [
        "something that repeats with the motion 0.97",
        "something at the knee 0.97",
        "a law of the knee&#39;s angle 0.97",
        "one of these, which these data cannot separate 0.95",
        "cogging at the knee 0.63",
        "parallel spring at the knee 0.32",
    ]
    at = [shown.index(words) for words in path]
    assert at == sorted(at)


def test_the_first_screen_tells_what_repeats_and_on_what_it_depends(tmp_path):
    shown = text_of(top(write_session(tmp_path / "leg")))
    assert "repeats with the motion 70% , 10% only with a person" in shown
    assert "a curve of it predicts angle speed hip 80% 20% knee 80% 20%" in shown


def test_where_nothing_is_missing_the_first_screen_says_how_sure_that_is(tmp_path):
    folder = write_session(tmp_path / "leg")
    told = decision_of(nothing=0.95, law=0.01) | {"findings": []}
    write_verdict(folder, status="nothing_missing", causes=[], **told)
    shown = text_of(top(folder))
    assert "nothing 0.95" in shown
    assert "What, and where" not in shown
    assert "detectability.json has the size from which each cause shows" in shown


def test_of_an_unlisted_law_the_headline_says_what_it_is_a_law_of(tmp_path):
    folder = write_session(tmp_path / "leg")
    told = decision_of()
    found = told["findings"][0] | {
        "level": "family",
        "words": "a law of the knee's angle",
        "path": told["findings"][0]["path"][:4],
    }
    write_verdict(folder, status="unknown_cause", causes=[], **told | {"findings": [found]})
    assert (
        "The simulation misses a law of the knee&#39;s angle, and no listed cause explains it"
        in top(folder)
    )


def test_a_verdict_of_an_older_version_has_no_cards_of_the_decision(tmp_path):
    folder = write_session(tmp_path / "leg")
    write_verdict(folder)
    assert "Is anything missing?" not in top(folder)


RIGHT_EDGES = """() => {
    const rows = new Map();
    for (const tile of document.querySelectorAll('.tile')) {
        const box = tile.getBoundingClientRect(), top = Math.round(box.top);
        const row = rows.get(top) || { tiles: 0, right: 0 };
        rows.set(top, { tiles: row.tiles + 1, right: Math.max(row.right, Math.round(box.right)) });
    }
    return [...rows.values()];
}"""


@pytest.mark.parametrize(
    ("causes", "width"),
    [
        pytest.param(
            causes,
            width,
            marks=() if (causes, width) in ((1, 390), (2, 700), (2, 1280)) else pytest.mark.slow,
        )
        for causes in (1, 2)
        for width in (390, 700, 1000, 1280)
    ],
)
def test_no_row_of_tiles_is_left_half_empty(opened, tmp_path, causes, width):
    folder = write_session(tmp_path / "axis", AXIS)
    write_verdict(
        folder,
        AXIS,
        causes=[
            cause(name, "axis") | {"gain": cause()["gain"] | {"joint": "axis"}}
            for name in ("cogging", "backlash")[:causes]
        ],
    )
    page_file = tmp_path / "report.html"
    page_file.write_text(report(find([folder])), encoding="utf-8")
    with opened(page_file, width=width) as page:
        for media in ("screen", "print"):
            page.emulate_media(media=media)
            rows = page.evaluate(RIGHT_EDGES)
            assert len({row["right"] for row in rows}) == 1
            assert all(row["tiles"] > 1 or width == 390 for row in rows)


@pytest.mark.parametrize(("sought_on", "runs"), [("all", "all runs"), ("train", "training runs")])
def test_the_split_of_the_error_says_which_runs_it_is_of(tmp_path, sought_on, runs):
    folder = write_session(tmp_path / "leg")
    write_verdict(folder, sought_on=sought_on, **decision_of())
    assert f"Shares of its mean square, {runs}." in top(folder)
