"""Two sessions side by side: what did not change is marked no more often than 95 % intervals
allow."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts import PARAMETERS
from pipelines.errors import InputError
from pipelines.report.html.compare import changes, compare, titles_of
from pipelines.report.sections.parameters import Estimate
from pipelines.report.session import find
from tests.report.sessions import (
    AXIS,
    LEG,
    verdict_of,
    write_parameters,
    write_recording,
    write_session,
    write_verdict,
)


def estimate(value, half, name="X1"):
    return Estimate(
        "rigid_body", name, name, "", "with_human", "kg·m²", value, value - half, value + half
    )


def pair(folder, shift):
    return [
        find([write_session(folder / name, shift=by)])
        for name, by in (("monday", 0.0), ("tuesday", shift))
    ]


@pytest.mark.parametrize("widths", [(1.0, 1.0), (0.2, 3.0)])
def test_of_parameters_that_did_not_change_one_in_twenty_is_marked(widths):
    rng = np.random.default_rng(7)
    first, second = (
        [estimate(w * z, 1.96 * w, str(k)) for k, z in enumerate(rng.standard_normal(4000))]
        for w in widths
    )
    marked = np.mean([change.is_beyond for change in changes(first, second)])
    assert marked == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / 4000))


def test_intervals_from_few_periods_mark_no_more_than_they_promise():
    # Student's t with 5 degrees of freedom, whose 97.5 % point is 2.57: the halves are that many
    # standard errors.
    rng = np.random.default_rng(8)
    sets = []
    for _ in range(2):
        scatter = np.sqrt(rng.chisquare(5, 4000) / 5)
        sets.append(
            [
                estimate(z, 2.57 * s, str(k))
                for k, (z, s) in enumerate(zip(rng.normal(size=4000), scatter, strict=True))
            ]
        )
    assert np.mean([change.is_beyond for change in changes(*sets)]) < 0.05 + 3 * np.sqrt(
        0.05 * 0.95 / 4000
    )


def test_a_change_beyond_the_intervals_is_marked_and_a_smaller_one_is_not():
    (beyond,) = changes([estimate(2.0, 0.03)], [estimate(2.051, 0.04)])
    (within,) = changes([estimate(2.0, 0.03)], [estimate(2.049, 0.04)])
    assert (beyond.is_beyond, within.is_beyond) == (True, False)
    assert beyond.half == pytest.approx(0.05)


def test_what_has_no_interval_is_not_judged():
    (taken,) = changes([estimate(2.0, 0.0)], [estimate(3.0, 0.0)])
    assert taken.is_beyond is None


def test_values_that_are_each_run_s_own_are_not_judged():
    first, second = (replace(estimate(value, 0.01), each_run=True) for value in (2.0, 3.0))
    (of_first_runs,) = changes([first], [second])
    assert of_first_runs.is_beyond is None
    assert "per run" in of_first_runs.words


def test_the_page_says_what_changed(tmp_path):
    first, second = pair(tmp_path, 0.06)
    page = compare(first, second, titles_of(first, second))
    assert (page.changed, page.judged) == (5, 5)
    assert "5 of 5 parameters changed beyond their intervals" in page.text
    assert len(re.findall('<tr class="changed">', page.text)) == 9
    same = compare(*pair(tmp_path / "again", 0.02), ("a", "b"))
    assert same.changed == 0
    assert "No parameter changed beyond its interval" in same.text


def told_apart(tmp_path, **changes):
    first, second = pair(tmp_path, 0.0)
    write_verdict(second.folders[0], **changes)
    return compare(first, find(second.folders), ("a", "b"))


NOTHING = {"status": "unknown_cause", "causes": []}


def test_a_verdict_that_changed_is_told_before_parameters_that_did_not(tmp_path):
    page = told_apart(tmp_path, **NOTHING)
    assert (
        page.headline
        == "The verdict went from explained to cause unknown; no parameter changed beyond its"
        " interval"
    )
    assert f"<h1>{page.headline}</h1>" in page.text


def test_other_causes_under_the_same_status_are_a_change_too(tmp_path):
    other = verdict_of()["causes"][0] | {"effect": "backlash"}
    assert told_apart(tmp_path, causes=[other]).headline.startswith("Other causes are named; ")


def test_each_error_stands_beside_the_floor_of_its_own_session(tmp_path):
    page = told_apart(tmp_path, **NOTHING, noise_floor_nm={"hip": 0.6, "knee": 0.5})
    assert (
        page.errors[2]
        == "knee, rigid body and friction: 0.818 N·m, 3.01 times the floor of 0.272 N·m → "
        "0.818 N·m, 1.64 times the floor of 0.500 N·m"
    )
    assert len(page.errors) == 4
    assert "Errors and the noise floor" in page.text


def test_settings_that_differ_are_listed_and_those_that_do_not_or_only_draw_are_not(tmp_path):
    config = [
        {"filter": {"cutoff_hz": cutoff, "order": 4}, "identify": {"figures": draws}}
        for cutoff, draws in (("auto", True), (20.0, False))
    ]
    sessions = []
    for name, one in zip(("monday", "tuesday"), config, strict=True):
        write_parameters(tmp_path / name)
        write_recording(tmp_path / name, config=one)
        sessions.append(find([tmp_path / name]))
    page = compare(*sessions, ("a", "b"))
    assert [(one.name, one.first, one.second) for one in page.settings] == [
        ("filter.cutoff_hz", '"auto"', "20.0")
    ]
    assert "<code>filter.cutoff_hz</code>" in page.text
    assert (
        "No setting that files of both sessions state differs"
        in compare(sessions[0], sessions[0], ("a", "a")).text
    )


def test_parameters_of_a_cause_that_only_one_session_names_are_told_as_such(tmp_path):
    first, second = pair(tmp_path, 0.0)
    path = second.folders[0] / "diagnosed" / "parameters.parquet"
    table = PARAMETERS.read(path)
    about = {key: value for key, value in table.metadata.items() if key != "covariance"}
    PARAMETERS.write(path, table.frame[table.frame["effect"] != "cogging"], about)
    write_verdict(second.folders[0], **NOTHING)
    text = compare(first, find(second.folders), ("a", "b")).text
    assert "Only in a: knee amplitude of cogging at the knee, which it names." in text


def test_folders_of_one_name_are_told_apart_by_those_above(tmp_path):
    sessions = [find([write_session(tmp_path / day / "demo")]) for day in ("monday", "tuesday")]
    assert titles_of(*sessions) == ("monday/demo", "tuesday/demo")


def test_a_hostile_session_is_escaped_beside_another(tmp_path, opened):
    first, second = pair(tmp_path, 0.06)
    evil = "</script><script>alert(1)</script>"
    write_verdict(second.folders[0], summary=evil, caveats=[evil])
    page_file = tmp_path / "compared.html"
    page_file.write_text(compare(first, find(second.folders), (evil, evil)).text, encoding="utf-8")
    with opened(page_file, width=390) as page:
        assert page.get_by_text(evil).count() > 2
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_sessions_of_different_machines_are_refused_by_what_differs(tmp_path):
    leg, axis = (
        find([write_session(tmp_path / name, joints)])
        for name, joints in (("leg", LEG), ("axis", AXIS))
    )
    says = (
        r"leg is of another machine than axis \(hip \(revolute\), knee \(revolute\), and axis"
        r" \(prismatic\)\)"
    )
    with pytest.raises(InputError, match=says):
        compare(leg, axis, ("leg", "axis"))


def test_a_parameter_of_another_unit_is_never_subtracted(tmp_path):
    first, second = pair(tmp_path, 0.0)
    path = second.folders[0] / "identified" / "parameters.parquet"
    table = PARAMETERS.read(path)
    table.frame.loc[0, "unit"] = "kg·m"
    PARAMETERS.write(path, table.frame, table.metadata)
    with pytest.raises(
        InputError, match=r"X1 \(with_human\) is in kg·m² and in kg·m, expected one unit"
    ):
        compare(first, find(second.folders), ("a", "b"))


def test_without_verdicts_the_page_says_why_no_errors_are_laid_side_by_side(tmp_path):
    sessions = []
    for name in ("monday", "tuesday"):
        write_parameters(tmp_path / name)
        sessions.append(find([tmp_path / name]))
    assert (
        "a verdict of each session, so errors cannot be compared"
        in compare(*sessions, ("a", "b")).text
    )
