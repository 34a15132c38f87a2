"""What the page says is what the files hold, whatever stages there were."""

import json
import re
import shutil

import pytest

from pipelines.contracts import PARAMETERS
from pipelines.contracts.provenance import provenance_of, sha256
from pipelines.errors import InputError
from pipelines.report.report import report
from pipelines.report.session import find
from tests.report.sessions import (
    AXIS,
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
        values = sorted(value for key, (value, _) in shown.items() if key.startswith(f"{folder}/parameters.parquet:"))
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
    made_of = {sha256(path) for path in session_folder.rglob("*") if path.suffix in (".parquet", ".json")}
    assert {one["sha256"] for one in told["inputs"]} == made_of


def test_the_page_asks_for_nothing_outside_itself(page_file):
    page = page_file.read_text(encoding="utf-8")
    assert not re.search(r"""(?:src|href)=["'](?!#|data:)""", page)
    assert "default-src 'none'" in page


@pytest.mark.parametrize(
    ("gone", "says"),
    [
        ("diagnosed", "a verdict, so nobody knows yet"),
        ("identified", "the model of rigid body and friction"),
        ("simulated", "replays, so nothing can be shown in motion"),
        ("recordings", "Not here yet: recordings"),
    ],
)
def test_an_experiment_that_lacks_a_stage_has_a_page_that_says_so(session_folder, tmp_path, gone, says):
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
    assert "diagnosed/verdict.json was made of another version of with_human_validate.parquet than the one here" in top


def test_two_verdicts_are_refused_in_a_line_that_says_what_to_do(tmp_path):
    for name in ("one", "two"):
        write_verdict(tmp_path / name)
    with pytest.raises(InputError, match=r"holds 2 verdicts \(one/diagnosed/verdict.json, two/.*--compare"):
        report(find([tmp_path]))


def test_folders_with_nothing_of_exoids_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no file of exoid's in it.*name the folder"):
        find([tmp_path])
    with pytest.raises(InputError, match="no such folder"):
        find([tmp_path / "nowhere"])


def test_a_broken_file_beside_good_ones_is_told_and_does_no_harm(tmp_path):
    write_parameters(tmp_path)
    (tmp_path / "broken.parquet").write_bytes(b"PAR1 and nothing else")
    page = report(find([tmp_path]))
    assert "broken.parquet: " in page
