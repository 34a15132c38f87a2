"""An experiment whose recordings came from elsewhere: an empty exoid.toml beside them is enough."""

import json

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts import PARAMETERS, RECORDING
from pipelines.errors import InputError

RATE_HZ = 200.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Two recordings of a pendulum of 0.5 kg·m², as `exoid import` leaves them, and an empty
    exoid.toml."""
    random = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    for name, purpose, phase in (("Monday-1", "train", 0.0), ("Monday-2", "validate", 1.0)):
        angle = 0.6 * np.sin(2.0 * time + phase) + 0.2 * np.sin(5.0 * time)
        speed = 1.2 * np.cos(2.0 * time + phase) + np.cos(5.0 * time)
        acceleration = -2.4 * np.sin(2.0 * time + phase) - 5.0 * np.sin(5.0 * time)
        torque = 0.5 * acceleration + 3.0 * np.sin(angle) + 0.4 * np.sign(speed) + 0.2 * speed
        frame = pd.DataFrame(
            {"time_s": time, "arm_angle_rad": angle + 1e-4 * random.standard_normal(len(time))}
        )
        frame["arm_torque_nm"] = torque + 0.05 * random.standard_normal(len(time))
        metadata = {
            "run": "exo_alone",
            "purpose": purpose,
            "sample_rate_hz": RATE_HZ,
            "imported": {"log": "arm.csv"},
            "joints": [{"name": "arm", "kind": "revolute"}],
        }
        RECORDING.write(tmp_path / "recordings" / f"{name}.parquet", frame, metadata)
    (tmp_path / "exoid.toml").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_is_filtered_identified_and_never_recorded(exoid, folder):
    stages = [one["stage"] for one in json.loads(exoid("status", "--json").out)]
    assert stages[:4] == ["filter", "filter", "identify", "diagnose"]
    outcome = exoid("run", "identify", "--json")
    assert outcome.code == 0, outcome.err
    assert [one["stage"] for one in json.loads(outcome.out)] == ["filter", "filter", "identify"]
    rows = json.loads(outcome.out)[-1]["result"]["parameters"]
    (inertia,) = [row["value"] for row in rows if row["unit"] == "kg·m²"]
    assert inertia == pytest.approx(0.5, abs=0.02)
    assert exoid("run", "identify").out == "Everything is up to date.\n"


@pytest.mark.parametrize(
    "words",
    [
        ("acquire",),
        ("design",),
        ("acquire", "--run", "Monday-1"),
        (
            "acquire",
            "--run",
            "Monday-1",
            "--trajectory",
            "mine.toml",
            "-o",
            "recordings/Monday-1.parquet",
        ),
    ],
)
def test_nothing_is_recorded_in_its_place(exoid, folder, words):
    before = (folder / "recordings" / "Monday-1.parquet").read_bytes()
    outcome = exoid(*words)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "imported" in outcome.err
    assert (folder / "recordings" / "Monday-1.parquet").read_bytes() == before


def test_results_of_another_machine_hold_no_settings_of_a_leg_until_they_are_written(exoid, folder):
    assert exoid("run", "identify").code == 0
    result = PARAMETERS.read(folder / "identified" / "parameters.parquet").metadata
    assert result["config"]["mechanism"] is None
    assert result["geometry"] == {"gravity_m_s2": 9.8}
    (folder / "exoid.toml").write_text('[mechanism]\nname = "single"\ngravity_m_s2 = 1.6\n')
    stale = {one["stage"]: one["why"] for one in json.loads(exoid("status", "--json").out)}[
        "identify"
    ]
    assert any(why.startswith("mechanism was unset, is ") for why in stale)


def test_a_machine_that_is_no_leg_is_not_asked_to_follow_a_gait(exoid, folder):
    assert "simulate" not in {one["stage"] for one in json.loads(exoid("status", "--json").out)}
    outcome = exoid("run", "simulate")
    assert (outcome.code, outcome.err) == (
        2,
        (
            "exoid: simulate: `exoid simulate` follows a leg's gait, and the recordings are of"
            " another machine; leave it out\n"
        ),
    )


def test_steps_that_cannot_be_done_are_listed_with_the_reason_after_the_count_of_the_others(
    exoid, folder, monkeypatch
):
    def refuse(*words, **named):
        raise InputError("backlash@arm: no simulation holds it; simulate the model without it")

    monkeypatch.setattr("pipelines.dynamics.plant.plant_from_table", refuse)
    outcome = exoid("run", "replay")
    assert outcome.code == 0
    assert outcome.out.splitlines()[-2].startswith("3 of 4 steps done in ")
    assert (
        outcome.out.splitlines()[-1]
        == "not done, so left out: simulated/replay-Monday-2.parquet: backlash@arm:"
        " no simulation holds it; simulate the model without it"
    )
    assert "0 of 4 steps done in 0 s; 3 were up to date" in exoid("run", "replay").out


def test_where_exoid_toml_is_lacking_it_is_said_that_an_empty_one_is_enough(exoid, folder):
    (folder / "exoid.toml").unlink()
    outcome = exoid("filter")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert (
        "put an empty exoid.toml next to recordings/, then `exoid run` uses what was imported"
        in outcome.err
    )


@pytest.mark.parametrize("remaining", [0, 4, 3000])
def test_a_damaged_recording_is_named_and_nothing_is_done_without_it(exoid, folder, remaining):
    path = folder / "recordings" / "Monday-1.parquet"
    path.write_bytes(path.read_bytes()[:remaining])
    for words in (
        ("run",),
        ("status",),
        ("filter",),
        ("identify",),
        ("diagnose",),
        ("simulate",),
        ("acquire",),
    ):
        outcome = exoid(*words)
        assert (outcome.code, outcome.err) == (
            2,
            (
                "exoid: recordings/Monday-1.parquet: damaged or truncated, and nothing is done"
                " without it; import it again, or remove it\n"
            ),
        )
        assert "up to date" not in outcome.out
    assert not (folder / "motions").exists()
    first = exoid("status").out.splitlines()[1]
    assert first.split()[:3] == ["import", "damaged", "recordings/Monday-1.parquet"]
    first = json.loads(exoid("status", "--json").out)[0]
    assert (first["target"], first["state"]) == ("recordings/Monday-1.parquet", "damaged")
    path.unlink()
    assert exoid("status").code == 0


def test_where_every_recording_is_damaged_all_are_named(exoid, folder):
    for path in (folder / "recordings").iterdir():
        path.write_bytes(b"PAR1")
    assert (
        exoid("run").err
        == "exoid: recordings/Monday-1.parquet, recordings/Monday-2.parquet: damaged or truncated,"
        " and nothing is done without them; import them again, or remove them\n"
    )


def test_a_table_of_another_program_next_to_the_recordings_is_none_of_them(exoid, folder):
    pd.DataFrame({"t": [0.0]}).to_parquet(folder / "recordings" / "log.parquet")
    assert exoid("status").code == 0


def test_a_damaged_recording_of_a_named_run_is_not_recorded_over_where_others_were_imported(
    exoid, folder
):
    path = folder / "recordings" / "spare.parquet"
    path.write_bytes(b"PAR1")
    runs = ""
    for number, purpose in enumerate(("train", "validate"), 1):
        (folder / "recordings" / f"Monday-{number}.parquet").rename(
            folder / "recordings" / f"run{number}.parquet"
        )
        runs += f'[[run]]\nname = "run{number}"\nrun = "exo_alone"\npurpose = "{purpose}"\n'
    (folder / "exoid.toml").write_text(runs)
    assert exoid("status").code == 0  # no run is named spare
    (folder / "exoid.toml").write_text(runs.replace("run1", "spare"))
    outcome = exoid("run")
    assert (outcome.code, "spare.parquet: damaged" in outcome.err) == (2, True)
    assert path.read_bytes() == b"PAR1"


def test_make_too_refuses_to_begin_with_a_damaged_recording(exoid, folder):
    (folder / "recordings" / "Monday-1.parquet").write_bytes(b"PAR1")
    outcome = exoid("settings", "split", "exoid.toml", "--out", ".settings")
    assert (outcome.code, "Monday-1.parquet: damaged" in outcome.err) == (2, True)
