"""``exoid show`` says what any file of exoid's is."""

import json

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts import RECORDING, describe, parquet
from tests.report.sessions import verdict_of


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "a.parquet"
    (tmp_path / "excitation.toml").write_text("a = []")
    frame = pd.DataFrame({"time_s": np.arange(5) * 0.005, "lab_note": "x"})
    for joint in ("hip", "knee"):
        frame[f"{joint}_angle_rad"] = np.linspace(-0.5, 0.5, 5)
        frame[f"{joint}_torque_nm"] = 1.0
        frame[f"{joint}_current_a"] = np.nan
    origin = describe(
        [tmp_path / "excitation.toml"], {"sample_rate_hz": 200.0, "bounds": {"hip": [0, 1]}}
    )
    RECORDING.write(
        path, frame, {"run": "exo_alone", "purpose": "train", "sample_rate_hz": 200.0, **origin}
    )
    return path


def test_a_table_is_shown_with_origin_metadata_and_columns_in_80_columns(exoid, recording):
    outcome = exoid("show", recording)
    assert outcome.code == 0
    title, *lines = outcome.out.splitlines()
    assert title == f"{recording}: recording/1, one run on the rig"
    for expected in (
        "created_by",
        "excitation.toml",
        "2 settings;",
        "sample_rate_hz",
        "rad",
        "-0.5",
        "float64",
    ):
        assert expected in outcome.out
    assert all(len(line) <= 80 for line in lines)


def test_json_may_be_asked_for_before_or_after_the_command(exoid, recording):
    after, before = exoid("show", recording, "--json"), exoid("--json", "show", recording)
    assert after.out == before.out
    result = json.loads(after.out)
    assert result["contract"] == "recording/1"
    assert result["rows"] == 5
    columns = {column["column"]: column for column in result["columns"]}
    assert columns["hip_angle_rad"]["max"] == 0.5
    assert columns["hip_current_a"]["nulls"] == 5
    assert (columns["lab_note"]["min"], columns["lab_note"]["max"]) == (None, None)
    assert result["origin"]["config"]["bounds"] == {"hip": [0, 1]}


def test_a_verdict_is_shown_by_its_words_and_numbers(exoid, tmp_path):
    document = verdict_of(unexplained={"hip": 0.1, "knee": None})
    path = tmp_path / "verdict.json"
    path.write_text(json.dumps(document))
    outcome = exoid("show", path)
    assert (outcome.code, outcome.err) == (0, "")
    for words in (
        "Missing from the simulation: cogging",
        "cogging at the knee (drive), probability 0.90",
        "  amplitude 1.5 N·m (1.4 … 1.6)",
        "  - it takes 0.50 of 0.82",
        "at the floor",
    ):
        assert words in outcome.out


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"contract": "verdict/1", "status"', "is not a whole JSON document (line 1, column 35:"),
        ('{"contract": "verdict/1"}', "status: missing; add it"),
        (
            json.dumps(verdict_of(noise_floor_nm={"hip": 0.1, "knee": float("nan")})),
            "noise_floor_nm.knee: found nan, expected a finite number",
        ),
    ],
)
def test_a_damaged_verdict_is_refused_in_a_line_that_names_the_key(exoid, tmp_path, text, says):
    path = tmp_path / "verdict.json"
    path.write_text(text)
    outcome = exoid("show", path)
    assert outcome.code == 2
    assert outcome.err.startswith(f"exoid: {path}: {says}")
    assert "Parquet" not in outcome.err


def test_quiet_prints_nothing(exoid, recording):
    assert exoid("show", recording, "-q").out == ""


def test_a_file_that_breaks_its_contract_is_shown_and_then_refused(exoid, tmp_path):
    import pyarrow as pa

    path = tmp_path / "bad.parquet"
    parquet.save(path, [pa.table({"time_s": [0.0, 1.0]})], {"contract": "trajectory/1"})
    outcome = exoid("show", path)
    assert outcome.code == 2
    assert "trajectory/1" in outcome.out
    assert (
        outcome.err
        == f"exoid: {path}: column hip_angle_rad is missing, expected joint angle (rad); "
        "a trajectory/1 table must have it\n"
    )


def test_verdict_and_trajectory_toml_are_recognised(exoid, tmp_path):
    verdict = tmp_path / "verdict.json"
    verdict.write_text(json.dumps(verdict_of()))
    outcome = exoid("show", verdict)
    assert outcome.code == 0
    assert "verdict/1" in outcome.out
    trajectory = tmp_path / "paper.toml"
    trajectory.write_text(
        'unit = "deg"\nomega_rad_s = 0.628\ntheta0_rad = [0.1, 0.2]\na = [[1.0]]\nb = [[2.0]]\n'
    )
    assert "trajectory as TOML" in exoid("show", trajectory).out


def test_what_a_motion_would_reveal_is_shown_with_its_origin_and_set_to_the_left(exoid, tmp_path):
    path = tmp_path / "detectability.json"
    message = {
        "causes": [{"effect": "base_tilt", "joint": None}],
        "provenance": {"created_by": "exoid 9"},
    }
    path.write_text(json.dumps({"contract": "detectability/1"} | message))
    outcome = exoid("show", path)
    assert (outcome.code, outcome.err) == (0, "")
    assert "detectability/1, the smallest detectable size of each cause" in outcome.out
    lines = [line.rstrip() for line in outcome.out.splitlines()]
    assert "created_by          exoid 9" in lines  # under "Where it came from", and to the left
    assert "causes[0].effect  base_tilt" in lines


@pytest.mark.parametrize("content", [None, b"", b"hello", b"PAR1", b"\xff\xfe"])
def test_what_is_no_exoid_file_is_one_line_and_exit_code_2(exoid, tmp_path, content):
    path = tmp_path / "x"
    if content is not None:
        path.write_bytes(content)
    outcome = exoid("show", path)
    assert outcome.code == 2
    assert outcome.err.startswith(f"exoid: {path}: ")
    assert outcome.err.count("\n") == 1


def test_nan_counts_as_missing_and_is_in_no_range(exoid, tmp_path):
    import pyarrow as pa

    path = tmp_path / "nan.parquet"
    parquet.save(
        path, [pa.table({"time_s": [0.0, float("nan"), None, 1.0]})], {"contract": "trajectory/1"}
    )
    (column,) = json.loads(exoid("show", path, "--json").out)["columns"]
    assert (column["nulls"], column["min"], column["max"]) == (2, 0.0, 1.0)
