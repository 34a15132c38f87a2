"""From a log without one joint's torque to the report; what needs every torque says so."""

import json
import shutil

import numpy as np
import pytest

from exoid_cli.app import run
from pipelines.contracts import PARAMETERS, RECORDING, RESIDUALS

pytest.importorskip("mujoco")
from tests.diagnosis.machines import PERIOD_S
from tests.diagnosis.planar_arm import LENGTH, planar_arm

MAP = f"""
[time]
column = "time_s"
unit = "s"

[[joint]]
name = "shoulder"
angle = {{ column = "shoulder_angle_rad", unit = "rad" }}
torque = {{ column = "shoulder_torque_nm", unit = "N·m" }}

[[joint]]
name = "elbow"
drive = "unmeasured"
angle = {{ column = "elbow_angle_rad", unit = "rad" }}

[geometry]
thigh_length_m = {LENGTH}
gravity_m_s2 = 0.0

[[recording]]
name = "{{file}}"
files = "train.csv"
purpose = "train"
period_s = {PERIOD_S}

[[recording]]
name = "{{file}}"
files = "validate.csv"
purpose = "validate"
period_s = {PERIOD_S}
"""


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    """Two imported logs, with a spring at the shoulder."""
    folder = tmp_path_factory.mktemp("imported") / "experiment"
    folder.mkdir()
    for purpose, seed in (("train", 1), ("validate", 2)):
        frame = planar_arm(purpose, seed).frame
        # A spring changes the torque that this motion takes, and nothing else.
        frame["shoulder_torque_nm"] += 6.0 * (frame["shoulder_angle_rad"] - 0.2)
        frame.drop(columns="elbow_torque_nm").to_csv(folder / f"{purpose}.csv", index=False)
    (folder / "map.toml").write_text(MAP, encoding="utf-8")
    (folder / "exoid.toml").touch()
    logs = [str(folder / f"{purpose}.csv") for purpose in ("train", "validate")]
    given = ["--map", str(folder / "map.toml"), "-o", str(folder / "recordings")]
    assert run(["import", *logs, *given]) == 0
    return folder


@pytest.fixture
def folder(imported, tmp_path, monkeypatch):
    """The current folder: an experiment of them."""
    copied = shutil.copytree(imported, tmp_path / "experiment")
    monkeypatch.chdir(copied)
    return copied


def test_every_stage_that_needs_no_simulation_runs(exoid, folder):
    recording = RECORDING.read(folder / "recordings" / "train.parquet").frame
    assert recording["elbow_torque_nm"].isna().all()
    outcome = exoid("run")
    assert outcome.code == 0, outcome.err
    assert "parallel spring at the shoulder" in outcome.out
    assert "nan" not in outcome.out.lower().split()
    assert "the torque of the elbow was not measured" in outcome.err
    table = PARAMETERS.read(folder / "identified" / "parameters.parquet").frame
    assert set(table["joint"].dropna()) == {"shoulder"}
    rows = RESIDUALS.read(folder / "diagnosed" / "residuals.parquet").frame
    assert rows["elbow_residual_nm"].isna().all()
    assert np.isfinite(rows["shoulder_residual_nm"]).all()
    verdict = json.loads((folder / "diagnosed" / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["causes"][0]["effect"] == "parallel_spring"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "the torque of the elbow was not measured" in page
    assert "elbow torque" not in page


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "identified/parameters.parquet", "-o", "simulated/"),
        ("simulate", "identified/parameters.parquet", "--replay", "recordings/validate.parquet"),
        ("export", "identified/parameters.parquet", "--to", "urdf"),
    ],
)
def test_what_needs_every_torque_says_so_in_one_line(exoid, folder, words):
    assert exoid("identify", *map(str, folder.glob("recordings/*")), "-o", "identified").code == 0
    outcome = exoid(*words)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.count("\n") == 1
    assert "elbow was not measured" in outcome.err
    assert 'a measured torque or drive = "none"' in outcome.err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ('torque = { column = "shoulder_torque_nm", unit = "N·m" }', 'drive = "unmeasured"'),
            "joint: none has a measured torque, expected one at least",
        ),
        (
            ('name = "shoulder"', 'name = "shoulder"\ndrive = "unmeasured"'),
            'torque: found with drive = "unmeasured", expected none',
        ),
        (
            ('drive = "unmeasured"', ""),
            'drive = "unmeasured" for one whose torque was not recorded',
        ),
    ],
)
def test_a_map_says_of_each_joint_where_its_torque_is(exoid, folder, change, said):
    (folder / "map.toml").write_text(MAP.replace(*change), encoding="utf-8")
    outcome = exoid("import", "train.csv", "--map", "map.toml")
    assert outcome.code == 2
    assert said in outcome.err


def test_a_guessed_map_names_the_option_where_no_torque_is_found(exoid, folder):
    outcome = exoid("import", "train.csv", "--guess")
    assert 'set drive = "unmeasured"' in outcome.out
