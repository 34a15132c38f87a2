"""A new experiment from `exoid init` to the simulated leg, over Modbus TCP, on a rig that hides nothing."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest

from pipelines.contracts import PARAMETERS
from pipelines.settings.rig import load_rig

CHANGES = {
    "seconds = 60.0 ": "seconds = 2.0 ",
    "base_frequency_hz = 0.1 ": "base_frequency_hz = 0.2 ",
    "harmonics = 5\n": "harmonics = 3\n",
    'rig = "rigs/default.toml"': 'rig = "rigs/plain.toml"',
    "duration_s = 40.0\n": "duration_s = 15.0\n",
    "figures = true": "figures = false",
}
AT_99_9 = 3.29 / 1.96
"""From the half-width of a 95 % interval to that of a 99.9 % one."""


@pytest.fixture
def experiment(exoid, tmp_path):
    folder = tmp_path / "experiment"
    assert exoid("init", folder).code == 0
    for old, new in CHANGES.items():
        change(folder / "exoid.toml", old, new)
    change(folder / "rigs" / "plain.toml", "ramp_s = 3.0", "ramp_s = 1.0")
    return folder


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def make(folder):
    """Run make as a user would; returns what it said and the stages that ran."""
    command = ["make", "-C", folder, f"EXOID={sys.executable} -m exoid_cli.app"]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "MAKEFLAGS": ""})
    assert done.returncode == 0, done.stderr
    return done.stdout, re.findall(r"^\S+ -m exoid_cli\.app (\w+)", done.stdout, flags=re.MULTILINE)


def written(folder):
    """When each of the experiment's files was written."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def test_a_new_experiment_finds_the_truth_of_a_rig_that_hides_nothing_and_does_nothing_twice(experiment):
    _, stages = make(experiment)
    assert sorted(stages) == sorted(["design", *["acquire", "filter"] * 4, "identify", "diagnose", *["simulate"] * 3])
    found = PARAMETERS.read(experiment / "identified" / "parameters.parquet").frame
    middle, half = found["value"], AT_99_9 * (found["ci95_high"] - found["ci95_low"]) / 2
    apart = np.abs(middle - truth(experiment)) / half
    assert (apart < 1.0).all(), found.assign(truth=truth(experiment), apart=apart).to_string()
    # An interval that covers everything would not be an answer.
    body = found["effect"] == "rigid_body"
    assert (half[body] < 0.15 * middle[body] + 0.02).all()

    before = written(experiment)
    said, stages = make(experiment)
    assert (stages, written(experiment)) == ([], before)
    assert "Nothing to be done" in said

    change(experiment / "exoid.toml", "feedback_gain_nm_s_rad = 300.0", "feedback_gain_nm_s_rad = 200.0")
    _, stages = make(experiment)
    changed = {path for path, when in written(experiment).items() if before.get(path) != when}
    names = {path.name for path in changed if ".settings" not in path.parts}
    assert stages == ["simulate"]
    assert names == {"exoid.toml", "rbf.parquet", "kv-sweep.csv"}


def truth(experiment):
    """What the rig file says, in the order of the rows of ``parameters/1``."""
    plant = load_rig(experiment / "rigs" / "plain.toml").plant
    exo, human = np.array(plant.exo_inertial), np.array(plant.human_inertial)
    friction = np.column_stack([plant.coulomb_nm, plant.viscous_nm_s_rad]).ravel()
    return np.concatenate([exo, friction, exo + human, human])
