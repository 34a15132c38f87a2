"""What the page says is what the files hold, whatever stages there were."""

import json
import platform
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts import CANDIDATES, PARAMETERS, RESIDUALS, Joint, describe
from pipelines.contracts.provenance import provenance_of, sha256
from pipelines.errors import InputError
from pipelines.report.html.report import report
from pipelines.report.sections import commands, provenance
from pipelines.report.sections.animation import animations
from pipelines.report.sections.error_budget import budget
from pipelines.report.sections.fit_quality import moving
from pipelines.report.session import find
from pipelines.report.session_charts import charts
from tests.report.sessions import (
    AXIS,
    RUN,
    checked_verdict,
    verdict_of,
    write_parameters,
    write_recording,
    write_replay,
    write_residuals,
    write_session,
    write_verdict,
)

TOLD = re.compile(r'<data value="([^"]*)" data-key="([^"]*)">([^<]*)</data>')


def told(page):
    return {key: (float(value), shown) for value, key, shown in TOLD.findall(page)}


def test_numbers_on_the_page_equal_those_in_the_files(session_folder, page_file):
    shown = told(page_file.read_text(encoding="utf-8"))
    said = json.loads((session_folder / "diagnosed" / "verdict.json").read_text(encoding="utf-8"))
    for key in ("noise_floor_nm", "baseline_rmse_nm", "extended_rmse_nm"):
        for joint, value in said[key].items():
            assert shown[f"{key}.{joint}"][0] == value
            assert float(shown[f"{key}.{joint}"][1]) == pytest.approx(value, rel=5e-3)
    for joint, shares in said["error_budget"].items():
        for key, share in shares.items():
            assert shown[f"error_budget.{joint}.{key}"][0] == share
    for folder in ("identified", "diagnosed"):
        rows = PARAMETERS.read(session_folder / folder / "parameters.parquet").frame
        values = sorted(
            value
            for key, (value, _) in shown.items()
            if key.startswith(f"{folder}/parameters.parquet:")
        )
        assert values == sorted(rows["value"])


def test_the_page_has_its_six_parts_and_stays_under_five_megabytes(page_file):
    page = page_file.read_text(encoding="utf-8")
    assert re.findall(r'<section id="(\w+)"', page) == [
        "verdict",
        "measured",
        "error",
        "model",
        "control",
        "provenance",
    ]
    assert "Not here yet" not in page
    assert len(page.encode()) < 5_000_000


def test_a_session_of_many_long_runs_stays_under_five_megabytes(tmp_path):
    write_verdict(tmp_path)
    models = [write_parameters(tmp_path, extended=which) for which in (False, True)]
    write_residuals(tmp_path, seconds=2000.0)
    for number in range(8):
        recording = write_recording(tmp_path, name=f"run{number}.parquet", seconds=10.0 + number)
        for model in models:
            write_replay(tmp_path, model, recording, seconds=40.0)
    page = report(find([tmp_path]))
    assert 2_000_000 < len(page.encode()) < 5_000_000


def test_the_page_tells_what_it_was_made_of_as_every_result_does(session_folder, page_file):
    told = provenance_of(page_file)
    made_of = {
        sha256(path)
        for path in session_folder.rglob("*")
        if path.suffix in (".parquet", ".json", ".csv")
    }
    assert {one["sha256"] for one in told["inputs"]} == made_of


def test_the_page_asks_for_nothing_outside_itself(page_file):
    page = page_file.read_text(encoding="utf-8")
    assert not re.search(r"""(?:src|href)=["'](?!#|data:)""", page)
    assert "default-src 'none'" in page


@pytest.mark.parametrize(
    ("gone", "says"),
    [
        ("diagnosed", "a verdict on what the model misses"),
        ("identified", "the model of rigid body and friction"),
        ("simulated", "replays, so nothing can be shown in motion"),
        ("recordings", "Not here yet: recordings"),
    ],
)
def test_an_experiment_that_lacks_a_stage_has_a_page_that_says_so(
    session_folder, tmp_path, gone, says
):
    folder = tmp_path / "part"
    shutil.copytree(session_folder, folder, ignore=shutil.ignore_patterns(gone))
    page = report(find([folder]))
    assert says in page
    assert "Not here yet" in page


def test_latencies_gaps_and_an_early_end_of_a_recording_are_told(tmp_path):
    latency = {"cycles": 4000, "median_ms": 1.25, "p99_ms": 3.5, "longest_ms": 41.0}
    write_recording(tmp_path, latency=latency, gaps=[[3.0, 7]], abort="watchdog: no new sample")
    page = report(find([tmp_path]))
    for words in ("1.25 ms", "99 %: 3.50, longest 41.0", "1, 7 samples", "watchdog: no new sample"):
        assert words in page


def test_a_machine_with_one_sliding_joint_is_told_of_in_newtons(tmp_path):
    page = report(find([write_session(tmp_path / "axis", AXIS)]))
    assert "axis force" in page
    assert "N·m" not in re.search(r'<section id="verdict".*?</section>', page, re.S)[0]


def test_what_was_made_of_an_older_recording_is_said_at_the_top(tmp_path):
    folder = write_session(tmp_path / "leg")
    write_recording(folder, seconds=10.0)
    top = re.search(r'<section id="verdict".*?</section>', report(find([folder])), re.S)[0]
    assert len(re.findall("has changed since", top)) == 1
    assert "with_human_validate.parquet has changed since" in top
    assert "more files were made of it; `exoid run` or `make` makes them again" in top


def imported(folder, **given):
    """Write a recording that was imported of a log and a map, the map beside it and the log
    elsewhere."""
    folder.mkdir()
    log, table = folder / "log.csv", folder / "machine.toml"
    log.write_text("t,q\n0,1\n")
    table.write_text("[time]\n")
    write_recording(
        folder, imported={"source": "log.csv", "given": given}, **describe([log, table])
    )
    log.unlink()
    return folder


def test_a_map_in_the_folder_is_known_by_its_bytes_and_a_log_elsewhere_by_the_path_it_was_given(
    tmp_path,
):
    folder = imported(tmp_path / "lab", source="../logs/log.csv", map="old/machine.toml")
    lines = commands.commands(find([folder]))
    assert (
        lines[0] == f"exoid import ../logs/log.csv --map {folder / 'machine.toml'} -o"
        f" {folder / 'recordings'}/"
    )
    (log,) = provenance.outside(find([folder]))
    assert (log.name, log.role, log.made_of_it) == (
        "../logs/log.csv",
        "a log",
        (f"recordings/{RUN}",),
    )
    assert "Inputs that are not in these folders" in report(find([folder]))
    (folder / "machine.toml").write_text("[joint]\n")
    assert "--map old/machine.toml" in commands.commands(find([folder]))[0]


def test_the_commands_that_repeat_it_end_with_the_report(session_folder):
    session = find([session_folder])
    assert commands.commands(session)[-1] == f"exoid report {session_folder}"
    assert f"exoid report {session_folder} --title Leg -o pages/leg.html" in report(
        session, "Leg", Path("pages/leg.html")
    )


def test_a_rigs_file_elsewhere_is_told_once_and_from_another_of_its_name(tmp_path):
    rig, settings = tmp_path / "rigs" / "default.toml", tmp_path / "experiments" / "default.toml"
    for number, path in enumerate((rig, settings)):
        path.parent.mkdir()
        path.write_text(f"# {number}\n")
    folder = tmp_path / "made"
    for name in ("a.parquet", "b.parquet"):
        write_recording(folder, name=name, **describe([rig], {"rig": {"name": "default"}}))
    write_parameters(folder, inputs=[settings])
    told = {(one.name, one.role): len(one.made_of_it) for one in provenance.outside(find([folder]))}
    assert told == {("default.toml", "the rig's file"): 2, ("default.toml", ""): 1}
    assert "recordings/a.parquet and 1 more" in report(find([folder]))


def test_a_set_that_holds_what_is_named_tells_what_it_adds_in_words(tmp_path):
    folder = write_session(tmp_path / "leg")
    path = folder / "diagnosed" / "candidates.parquet"
    table = CANDIDATES.read(path)
    rows = table.frame.copy()
    rows["causes"] = [["cogging@knee"], ["cogging@knee", "base_tilt"]]
    rows["rmse_after_hip_nm"], rows["rmse_after_knee_nm"] = [0.31, 0.30], [0.31, 0.29]
    rows["gain_nm"], rows.loc[1, "reason"] = (
        [0.41, 0.43],
        "base_tilt adds too little beside cogging@knee",
    )
    CANDIDATES.write(path, rows, table.metadata)
    line = re.search(r"<tr><td class=\"n\">2</td>.*?</tr>", report(find([folder])))[0]
    assert "<small>the named causes, and</small><br>base tilt</td>" in line
    assert "0.0200<br><small>beyond the named causes</small>" in line
    assert '<td class="reason">adds too little beside cogging at the knee</td>' in line


def test_versions_are_told_where_files_have_them_and_nothing_where_they_do_not(tmp_path):
    path = write_parameters(tmp_path)
    assert f"Made with Python {platform.python_version()}, numpy {np.__version__}" in report(
        find([tmp_path])
    )
    table = PARAMETERS.read(path)
    PARAMETERS.write(
        path,
        table.frame,
        {key: value for key, value in table.metadata.items() if key != "software"},
    )
    assert "Made with Python" not in report(find([tmp_path]))


def test_two_verdicts_are_refused_in_a_line_that_says_what_to_do(tmp_path):
    for name in ("one", "two"):
        write_verdict(tmp_path / name)
    with pytest.raises(
        InputError, match=r"holds 2 verdicts \(one/diagnosed/verdict.json, two/.*--compare"
    ):
        report(find([tmp_path]))


def test_folders_with_nothing_of_exoids_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no file of exoid's in it.*Name the folder"):
        find([tmp_path])
    with pytest.raises(InputError, match="no such folder"):
        find([tmp_path / "nowhere"])


def test_a_broken_file_beside_good_ones_is_told_and_does_no_harm(tmp_path):
    write_parameters(tmp_path)
    (tmp_path / "broken.parquet").write_bytes(b"PAR1 and nothing else")
    page = report(find([tmp_path]))
    assert "broken.parquet: " in page


def worsened(folder, joint="knee", effect="stribeck_friction"):
    """Write a verdict whose cause makes everything worse but the torque away from reversals."""
    said = verdict_of()
    cause = said["causes"][0] | {"effect": effect, "joint": joint}
    write_verdict(
        folder,
        causes=[cause],
        baseline_rmse_unmasked_nm={"hip": 0.8, "knee": 2.95},
        extended_rmse_unmasked_nm={"hip": 0.4, "knee": 3.38},
        extended_simulation_rmse_rad={"hip": 0.02, "knee": 0.0367},
    )


def verdict_part(page):
    return re.search(r'<section id="verdict".*?</section>', page, re.S)[0]


def test_where_the_causes_make_it_worse_that_is_said_on_the_tile_and_below(tmp_path):
    folder = write_session(tmp_path / "leg")
    assert "worse with the causes" not in verdict_part(report(find([folder])))
    worsened(folder)
    top = verdict_part(report(find([folder])))
    assert re.search(r"22\.4 → 36\.7 <span>mrad</span></div><small>worse with the causes", top)
    assert "the knee&#39;s torque error is 2.95 → 3.38 N·m with the causes" in top
    assert "The named causes raise the breakaway torque" in top
    assert (
        "the knee&#39;s error is 22.4 → 36.7 mrad with the causes: such a simulation has no"
        " feedback" in top
    )
    assert "the hip strays" not in top


def test_errors_are_told_away_from_reversals_and_with_them_as_the_residuals_have_them(
    session_folder, page_file
):
    rows = RESIDUALS.read(session_folder / "diagnosed" / "residuals.parquet").frame
    rows = (
        rows[rows["model"] == "extended"]["knee_residual_nm"],
        rows[rows["model"] == "extended"]["scored"],
    )
    shown = page_file.read_text(encoding="utf-8")
    for words, error in (
        ("away from reversals", rows[0][rows[1]]),
        ("reversals included", rows[0]),
    ):
        line = re.search(rf"<td>knee torque, computed, {words}, N·m</td>(.*?)</tr>", shown)[1]
        assert float(re.findall(r'value="([^"]*)"', line)[1]) == pytest.approx(
            np.sqrt(np.mean(error**2))
        )


def test_seconds_in_which_a_joint_stands_are_told_from_those_in_which_it_moves_throughout():
    time = np.arange(0, 3.0, 0.005)
    # Stands from 1.0 to 1.6 s.
    place = np.where(time < 1.0, time, np.where(time < 1.6, 1.0, time - 0.6))
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(time))
    frame = pd.DataFrame(
        {
            "time_s": time,
            "window": (time // 1.0).astype(int),
            "knee_reference_rad": place + noise,
            "x": 0,
        }
    )
    assert set(frame.loc[moving(frame, Joint("knee")), "window"]) == {0, 2}


@pytest.mark.parametrize("status", ["nothing_missing", "unknown_cause"])
def test_a_verdict_without_causes_shows_the_model_without_them_alone(tmp_path, status):
    folder = write_session(tmp_path / "leg")
    write_verdict(
        folder,
        status=status,
        causes=[],
        error_budget={j: {"noise_floor": 0.07} for j in ("hip", "knee")},
    )
    session = find([folder])
    page = report(session)
    drawn = {series.label for chart in charts(session).all for series in chart.all_series}
    assert "rigid body and friction" in drawn
    assert "with the causes" not in drawn
    assert all(set(one.angles) == {"measured", "before"} for one in animations(session))
    for words in ("with the cause", "with the named cause"):
        assert words not in page[: page.index('<script type="application/json"')]


def test_a_budget_below_the_floor_says_so_and_gives_no_second_floor(tmp_path):
    shares = {joint: {"noise_floor": 0.07, "unexplained": 0.0} for joint in ("hip", "knee")}
    floor = {joint: 0.3 for joint in shares}
    below, _ = budget(checked_verdict(error_budget=shares, noise_floor_nm=floor))
    assert below.segments[0].label == "noise, all of it below the floor"
    floor = {joint: 0.07**0.5 for joint in shares}
    at, _ = budget(checked_verdict(error_budget=shares, noise_floor_nm=floor))
    assert at.segments[0].label == "noise floor"


def test_what_is_taken_has_a_unit_in_the_heading_and_none_an_interval_of_no_width(tmp_path):
    folder = write_session(tmp_path / "leg")
    path = folder / "diagnosed" / "candidates.parquet"
    table = CANDIDATES.read(path)
    table.frame[["gain_nm", "gain_low_nm", "gain_high_nm"]] = 0.41
    CANDIDATES.write(path, table.frame, table.metadata)
    page = report(find([folder]))
    assert "gain, 95 %, N·m" in page
    assert "0.410 (no interval)" in page
    assert "0.410 (0.410" not in page


def test_every_symbol_is_explained_by_the_effect_it_belongs_to(page_file):
    page = page_file.read_text(encoding="utf-8")
    assert "tau = Ks sgn(v) + Km v" in page
    assert '<abbr title="friction torque once the joint moves">' in page
    assert "inertia about the hip with the knee at a right angle" in page
    foreseen = re.search(r"expected standard error.*?</table>", page, re.S)[0]
    assert re.search(r"<td>X1</td>.*?<td class=\"nowrap\">kg·m²</td>", foreseen)


def test_what_the_fits_say_against_a_model_stands_beside_its_parameters(tmp_path):
    told = {
        "collinear": ["this motion hardly separates X1 and spring"],
        "unrealizable": ["exo_alone: X1 is -0.3 kg·m²"],
        "angle_noise": ["above 5 Hz the angles hold noise"],
    }
    for extended in (False, True):
        path = write_parameters(tmp_path, extended=extended)
        table = PARAMETERS.read(path)
        PARAMETERS.write(path, table.frame, {**table.metadata, **told})
    page = report(find([tmp_path]))
    for words in ("hardly separates X1", "Not a real machine: exo_alone: X1", "Biased: above 5 Hz"):
        assert page.count(words) == 2


def test_a_cause_that_differs_from_run_to_run_is_called_so_and_every_run_s_value_is_listed(
    tmp_path,
):
    folder = write_session(tmp_path / "leg")
    sure = [0.0512, 0.0712]
    each_run = [
        {
            "file": "first.parquet",
            "purpose": "train",
            "values": {"offset": 0.0612},
            "ci95": {"offset": sure},
        },
        {
            "file": "judged.parquet",
            "purpose": "validate",
            "values": {"offset": -0.0503},
            "ci95": {"offset": None},
        },
        {
            "file": "absent.parquet",
            "purpose": "validate",
            "values": {"offset": None},
            "ci95": {"offset": None},
        },
    ]
    cause = verdict_of()["causes"][0] | {
        "effect": "encoder_offset",
        "side": "sensor",
        "indistinguishable_from": [],
        "each_run": each_run,
        "parameters": [{"name": "offset", "value": 0.0612, "unit": "rad", "ci95": sure}],
    }
    shares = {joint: {"noise_floor": 0.07, "encoder_offset@knee": 0.4} for joint in ("hip", "knee")}
    write_verdict(folder, causes=[cause], error_budget=shares)
    tried = CANDIDATES.read(folder / "diagnosed" / "candidates.parquet")
    tried.frame["causes"] = [["encoder_offset@knee"], ["encoder_offset@knee", "cogging@hip"]]
    CANDIDATES.write(folder / "diagnosed" / "candidates.parquet", tried.frame, tried.metadata)
    table = PARAMETERS.read(folder / "diagnosed" / "parameters.parquet")
    frame = table.frame.replace(
        {"effect": {"cogging": "encoder_offset"}, "name": {"amplitude": "offset"}}
    )
    frame["each_run"] = frame["effect"] == "encoder_offset"
    PARAMETERS.write(folder / "diagnosed" / "parameters.parquet", frame, table.metadata)
    page = report(find([folder]))
    assert "<h1>The simulation misses per-run encoder offset at the knee</h1>" in page
    assert "Why per-run encoder offset at the knee" in page
    assert '<li class="key cause1">per-run encoder offset at the knee: ' in page
    assert re.search(
        '<td>per-run encoder offset at the knee</td><td class="n">0.90</td><td><span class="pill'
        ' [^"]*">named',
        page,
    )
    shown = told(page)
    assert shown["each_run:encoder_offset/knee/first.parquet/offset"] == (0.0612, "0.061")
    assert shown["each_run:encoder_offset/knee/judged.parquet/offset"][0] == -0.0503
    assert '<th class="n">offset, rad</th>' in page
    assert "0.051 … 0.071" in page
    (never,) = re.findall('<tr><td class="file">absent.parquet.*?</tr>', page)
    assert "never came" in never and "data-key" not in never
    # The model's table holds the first run's: it says so of that value, and of no other.
    assert re.findall(
        '<td class="nowrap">([^<]*|<abbr[^>]*>[^<]*</abbr>) <small>encoder offset</small>', page
    )
    assert page.count("(per run: the first training run") == 1


def test_an_unlisted_law_among_the_sets_is_called_so_and_a_set_has_its_probability_once(tmp_path):
    folder = write_session(tmp_path / "leg")
    tried = CANDIDATES.read(folder / "diagnosed" / "candidates.parquet")
    tried.frame["causes"] = [["cogging@knee"], ["law:friction_by_angle@hip", "cogging@knee"]]
    tried.frame["probability"] = [0.9, 0.0012]
    tried.frame["reason"] = ["its causes are likely", "its probability is 0.0012; it holds a law"]
    CANDIDATES.write(folder / "diagnosed" / "candidates.parquet", tried.frame, tried.metadata)
    page = report(find([folder]))
    assert "friction of the hip that depends on its angle" in page
    assert '<td class="n">&lt; 0.01</td>' in page
    assert '<td class="reason">it holds a law</td>' in page
