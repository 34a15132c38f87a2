"""Machines of one joint through the commands, as a user with files of their own would."""

import json

import pytest

from pipelines.contracts import MOTION, PARAMETERS, RECORDING, SIMULATION
from tests.diagnosis.machines import slide


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slide")
    for seed, purpose in enumerate(("train", "validate")):
        table = slide(purpose, seed, seconds=15.0)
        RECORDING.write(folder / f"{purpose}.parquet", table.frame, table.metadata)
    return [folder / "train.parquet", folder / "validate.parquet"]


def test_a_slide_is_filtered_identified_and_simulated_in_its_own_units(exoid, recordings, tmp_path):
    train, validate = recordings
    assert exoid("filter", train, "-o", tmp_path / "train.parquet").code == 0
    assert "axis_velocity_m_s" in MOTION.read(tmp_path / "train.parquet").frame
    outcome = exoid("identify", tmp_path / "train.parquet", validate, "-o", tmp_path / "identified")
    assert outcome.code == 0, outcome.err
    assert "RMSE N" in outcome.out and "N·m" not in outcome.out
    table = PARAMETERS.read(tmp_path / "identified" / "parameters.parquet")
    assert table.metadata["mechanism"] == "single"
    assert table.frame["value"].to_numpy() == pytest.approx([90.0, 20.0, 200.0], rel=0.1)
    replayed = tmp_path / "replay.parquet"
    outcome = exoid(
        "simulate",
        tmp_path / "identified" / "parameters.parquet",
        "--replay",
        validate,
        "-o",
        replayed,
        "--json",
    )
    assert outcome.code == 0, outcome.err
    assert json.loads(outcome.out)["simulation_rmse_rad"]["axis"] < 0.002
    assert {"axis_position_m", "axis_force_n"} <= set(SIMULATION.read(replayed).frame.columns)
    assert "axis_force_n" in exoid("show", replayed).out


def test_a_simulation_of_a_slide_asks_what_to_follow(exoid, recordings, tmp_path):
    assert exoid("identify", *recordings, "-o", tmp_path).code == 0
    outcome = exoid(
        "simulate", tmp_path / "parameters.parquet", "-o", tmp_path / "out", "--run", "exo_alone"
    )
    assert outcome.code == 2
    assert (
        "is of axis, expected hip and knee: the gait is a leg's; name what to follow with"
        " --reference" in " ".join(outcome.err.split())
    )


def test_what_is_for_legs_alone_refuses_a_slide_in_one_line(exoid, recordings, tmp_path):
    chosen = tmp_path / "exoid.toml"
    chosen.write_text(
        '[mechanism]\nname = "single"\n[[mechanism.joints]]\nname = "axis"\nkind = "prismatic"\n'
    )
    outcome = exoid("design", "--config", chosen, "-o", tmp_path / "a.parquet")
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert (
        "mechanism: found single with axis (prismatic), expected a leg with hip and knee for `exoid"
        in outcome.err
    )
    assert (
        exoid("identify", "--config", chosen, *recordings, "-o", tmp_path / "identified").code == 0
    )
    chosen.write_text('[mechanism]\nname = "leg"\n')
    outcome = exoid("identify", "--config", chosen, *recordings, "-o", tmp_path / "identified")
    assert outcome.code == 2
    assert (
        "train.parquet has joints axis (prismatic), expected those of exoid.toml's [mechanism]"
        in outcome.err
    )
