"""A mechanism is one file: with it, and with nothing else changed, machines of its kind are known
everywhere."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from pipelines.contracts import PARAMETERS, RECORDING
from tests.conftest import Outcome
from tests.diagnosis.machines import PERIOD_S, RATE_HZ, excitation

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.long
(STAGE,) = re.findall(
    r"```python\n(.*?)```", (ROOT / "docs" / "mechanisms.md").read_text(encoding="utf-8"), re.DOTALL
)
"""A reader copies what the page shows."""
WITH_FOLDER = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from pipelines.mechanics import mechanisms
mechanisms.__path__.append(sys.argv[1])
from exoid_cli.app import run

outcomes = []
for words in json.loads(sys.argv[2]):
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run(words)
    outcomes.append([code, out.getvalue(), err.getvalue()])
print(json.dumps(outcomes))
"""
NAMED = """
[mechanism]
name = "stage"
joints = [{ name = "x", kind = "prismatic" }, { name = "y", kind = "prismatic" }]
"""
LOWER_KG, UPPER_KG, ANGLE = 60.0, 30.0, np.pi / 3


def stage(purpose, seed, asymmetry=0.0, seconds=15.0):
    """Return a recording of two slides at 60°, by Newton's law in the plane for each of the two
    bodies.

    20 N of dry and 200 N·s/m of viscous friction in each; in the upper one, so much more forwards
    than backwards.
    """
    references = [excitation(10 * seed + j, 0.06) for j in range(2)]
    kp, kd = np.array([2e5, 7e4]), np.array([6e3, 2e3])
    along = np.array([[1.0, 0.0], [np.cos(ANGLE), np.sin(ANGLE)]])

    def drives(t, x, v):
        wanted, rate = (
            np.array([reference[k](t)[0] for reference in references]) for k in range(2)
        )
        return kp * (wanted - x) + kd * (rate - v)

    # Unknown: both accelerations along the slides, and the force across that keeps the upper
    # body on its slide.
    across = np.array([-along[1][1], along[1][0]])
    lower = [LOWER_KG, 0.0, across[0]]
    upper = UPPER_KG * np.outer(along[0], [1, 0, 0]) + UPPER_KG * np.outer(along[1], [0, 1, 0])
    upper -= np.outer(across, [0, 0, 1])
    by_known = np.linalg.inv(np.vstack([lower, upper]))

    def rates(t, s):
        x, v = s[:2], s[2:]
        push = (
            drives(t, x, v)
            - 20.0 * np.tanh(v / 0.001)
            - 200.0 * v
            - [0.0, 0.5 * asymmetry * abs(v[1])]
        )
        known = [push[0] - push[1] * along[1][0], *(push[1] * along[1])]
        return np.append(v, (by_known @ known)[:2])

    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    begin = [reference[k](0.0)[0] for k in range(2) for reference in references]
    path = solve_ivp(
        rates, (0, seconds), begin, "RK23", time, rtol=1e-5, atol=1e-7, max_step=0.01
    ).y.T
    force = np.array([drives(t, s[:2], s[2:]) for t, s in zip(time, path, strict=True)])
    force += np.random.default_rng(seed).normal(0, 0.5, force.shape)
    columns = {"time_s": time}
    for j, name in enumerate("xy"):
        columns |= {f"{name}_position_m": path[:, j], f"{name}_force_n": force[:, j]}
    metadata = {
        "contract": "recording/1",
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": RATE_HZ,
        "period_s": PERIOD_S,
        "joints": [{"name": name, "kind": "prismatic"} for name in "xy"],
    }
    return pd.DataFrame(columns), metadata


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    for seed, purpose in enumerate(("train", "validate")):
        RECORDING.write(folder / f"{purpose}.parquet", *stage(purpose, seed))
        RECORDING.write(
            folder / f"asymmetric_{purpose}.parquet", *stage(purpose, seed, asymmetry=150.0)
        )
    return folder


@pytest.fixture(scope="module")
def exoid_with_it(tmp_path_factory):
    """Run command lines, one after the other in one process, where the page's file, and what else
    is given, stands beside exoid's own mechanisms."""

    def run(*lines, **others):
        folder = tmp_path_factory.mktemp("mechanisms")
        for name, text in {"stage": STAGE, **others}.items():
            (folder / f"{name}.py").write_text(text, encoding="utf-8")
        words = json.dumps([[str(word) for word in line] for line in lines])
        done = subprocess.run(
            [sys.executable, "-c", WITH_FOLDER, str(folder), words],
            capture_output=True,
            text=True,
            cwd=tmp_path_factory.mktemp("elsewhere"),
            env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"},
        )
        assert done.returncode == 0, done.stderr
        return [Outcome(*one) for one in json.loads(done.stdout)]

    return run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return where all that exoid makes of the recordings is."""
    return tmp_path_factory.mktemp("made")


@pytest.fixture(scope="module")
def outcomes(exoid_with_it, recordings, folder):
    """Return what came of each command, by its first word or by the format it exports to."""
    (folder / "exoid.toml").write_text(NAMED, encoding="utf-8")
    plain, asymmetric = (
        [recordings / f"{kind}{purpose}.parquet" for purpose in ("train", "validate")]
        for kind in ("", "asymmetric_")
    )
    model = folder / "parameters.parquet"
    lines = {
        "identify": ["identify", *plain, "--config", folder / "exoid.toml", "-o", folder],
        "diagnose": ["diagnose", *asymmetric, "-o", folder / "diagnosed", "--no-figures"],
        "simulate": [
            *("simulate", model, "--replay", plain[1]),
            *("-o", folder / "replay.parquet", "--json"),
        ],
        "c": ["export", model, "--to", "c", "-o", folder / "stage.c"],
        "urdf": ["export", model, "--to", "urdf", "-o", folder / "stage.urdf"],
    }
    return dict(zip(lines, exoid_with_it(*lines.values()), strict=True))


def test_its_parameters_are_recovered_from_a_machine_that_newton_moved(outcomes, folder):
    assert outcomes["identify"].code == 0, outcomes["identify"].err
    table = PARAMETERS.read(folder / "parameters.parquet")
    assert table.metadata["mechanism"] == "stage"
    assert "thigh_length_m" not in table.metadata["geometry"]
    expected = [LOWER_KG + UPPER_KG, UPPER_KG, UPPER_KG * np.cos(ANGLE), 20.0, 200.0, 20.0, 200.0]
    assert table.frame["value"].to_numpy() == pytest.approx(expected, rel=0.01)
    assert list(table.frame["unit"]) == ["kg", "kg", "kg", "N", "N·s/m", "N", "N·s/m"]


def test_what_is_hidden_in_it_is_named(outcomes, folder):
    assert outcomes["diagnose"].code == 0, outcomes["diagnose"].err
    verdict = json.loads((folder / "diagnosed" / "verdict.json").read_text(encoding="utf-8"))
    (cause,) = verdict["causes"]
    assert (cause["effect"], cause["joint"], verdict["status"]) == (
        "viscous_asymmetry",
        "y",
        "explained",
    )
    assert cause["parameters"][0]["value"] == pytest.approx(75.0, rel=0.03)


def test_it_moves_as_it_was_recorded(outcomes):
    assert outcomes["simulate"].code == 0, outcomes["simulate"].err
    assert max(json.loads(outcomes["simulate"].out)["simulation_rmse_rad"].values()) < 0.0005


def test_it_is_exported_where_no_bodies_are_asked_for(outcomes, folder):
    assert outcomes["c"].code == 0, outcomes["c"].err
    assert "rigid_body_X3 * at->ddq[1]" in (folder / "stage.c").read_text(encoding="utf-8")
    refused = outcomes["urdf"]
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert (
        "stage (two level prismatic joints, the second carried by the first) has no rule for"
        in refused.err
    )
    assert not (folder / "stage.urdf").exists()


def test_without_its_file_it_is_refused_with_what_there_is(
    exoid, recordings, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    outcome = exoid("identify", recordings / "train.parquet", "-o", tmp_path / "out")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert (
        "train.parquet has joints x (prismatic), y (prismatic) and gravity 0 m/s², expected"
        " those of" in outcome.err
    )
    assert (
        "two revolute joints in series, whose axes are parallel, under gravity; two revolute joints"
        in outcome.err
    )
    assert "; one revolute joint under gravity; " in outcome.err
    (tmp_path / "exoid.toml").write_text(NAMED, encoding="utf-8")
    outcome = exoid("identify", recordings / "train.parquet", "-o", tmp_path / "out")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert (
        "exoid.toml: mechanism.name: found 'stage', expected a mechanism's name, or a file for"
        " a new" in outcome.err
    )


def test_two_mechanisms_with_equal_joints_and_gravity_are_refused(
    exoid_with_it, recordings, tmp_path
):
    other = STAGE.replace('name="stage"', 'name="table"').replace(
        "has_gravity=None", "has_gravity=True"
    )
    line = ["identify", recordings / "train.parquet", "-o", tmp_path]
    (done,) = exoid_with_it(line, table=other)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert done.err.startswith(
        "exoid: two mechanisms have the joints prismatic, prismatic: stage (two level "
    )
