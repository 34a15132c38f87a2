"""Joints that turn without end, and joints without a drive, as a map declares them."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from exoid_cli.app import run
from pipelines.contracts import PARAMETERS
from tests.diagnosis.free_elbow import TRUTH, free_elbow
from tests.importing.conftest import MAP

PAGE = Path(__file__).parents[2] / "docs" / "mechanisms.md"
EXAMPLE = next(
    text
    for text in re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    if "[[joint]]" in text
)
"""The map that the page shows."""
LEVEL = MAP + "\n[geometry]\ngravity_m_s2 = 0.0\n"
TURNS = MAP.replace('name = "pivot"', 'name = "pivot"\nturns = true')


@pytest.fixture
def shaft():
    """A shaft that makes 18 turns in 10 s, and 0.4 turns from row to row where it is fastest."""
    time = np.arange(500) / 50.0
    speed = 2.0 * np.pi * (1.8 + 18.0 * np.sin(2.0 * np.pi * time / 5.0))
    angle = np.cumsum(speed) / 50.0
    torque = 0.01 * np.gradient(speed, time) + 0.004 * speed + 0.05 * np.sign(speed)
    return {"time": time, "angle": angle, "velocity": speed, "torque": torque}


def angle_of(outcome):
    assert outcome.code == 0, outcome.err
    return outcome.recording().frame["pivot_angle_rad"].to_numpy()


def test_a_shaft_without_gravity_may_turn_on_and_the_import_says_how_to_declare_it(
    imported, shaft, write_csv
):
    outcome = imported(write_csv(shaft), map_text=LEVEL)
    assert_allclose(angle_of(outcome), shaft["angle"], atol=1e-12)
    assert "turns; kept, as no torque depends on it; set turns = true" in outcome.printed


def test_under_gravity_the_map_must_say_that_a_joint_turns_on(imported, shaft, write_csv):
    log = write_csv(shaft)
    outcome = imported(log)
    assert outcome.code == 2
    assert "or set turns = true for a joint that turns without end" in outcome.err
    assert_allclose(angle_of(imported(log, map_text=TURNS)), shaft["angle"], atol=1e-12)


@pytest.mark.parametrize(
    ("unit", "turn"),
    [('"rad"', 2.0 * np.pi), ('"deg"', 360.0), ('"counts", counts_per_turn = 4096', 4096.0)],
)
def test_an_encoder_that_starts_again_after_a_turn_is_unwrapped(
    imported, shaft, write_csv, unit, turn
):
    read = shaft["angle"] / (2.0 * np.pi) * turn % turn
    if "counts" in unit:
        read = np.floor(read).astype(int)
    text = TURNS.replace('unit = "rad" }', f"unit = {unit} }}", 1)
    angle = angle_of(imported(write_csv(shaft | {"angle": read}), map_text=text))
    assert_allclose(angle - angle[0], shaft["angle"] - shaft["angle"][0], atol=0.002)


def test_a_slide_does_not_turn(imported, shaft, write_csv):
    text = TURNS.replace("turns = true", 'turns = true\nkind = "prismatic"').replace('"rad', '"m')
    outcome = imported(write_csv(shaft), map_text=text.replace("N·m", "N"))
    assert (outcome.code, "turns: found at a prismatic joint" in outcome.err) == (2, True)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('name = "pivot"', 'name = "pivot"\ndrive = "none"'), 'torque: found with drive = "none"'),
        (('torque = { column = "torque", unit = "N·m" }', ""), 'or set drive = "none" for a joint'),
        (
            ('torque = { column = "torque", unit = "N·m" }', 'drive = "none"'),
            "joint: none has a measured torque, expected one at least",
        ),
    ],
)
def test_a_joint_has_either_a_torque_or_no_drive(imported, shaft, write_csv, change, said):
    outcome = imported(write_csv(shaft), map_text=MAP.replace(*change))
    assert (outcome.code, outcome.out) == (2, "")
    assert said in outcome.err


def test_a_torque_that_is_zero_in_every_row_leads_to_the_key_of_a_passive_joint(
    imported, pendulum, write_csv
):
    outcome = imported(write_csv(pendulum.columns() | {"torque": 0.0 * pendulum.time}))
    assert 'set drive = "none" in place of the table' in outcome.printed


def test_the_page_s_arm_with_a_free_elbow_is_identified(tmp_path):
    time, q, torque = free_elbow(3, speed=14.0)
    elbow = np.degrees(q[:, 1]) % 360.0
    rows = zip(time, np.degrees(q[:, 0]), elbow, torque, strict=True)
    log = tmp_path / "log.csv"
    log.write_text(
        "time_s,shoulder_deg,elbow_deg,shoulder_nm\n"
        + "".join("{:.3f},{:.4f},{:.4f},{:.4f}\n".format(*row) for row in rows)
    )
    (tmp_path / "map.toml").write_text(EXAMPLE, encoding="utf-8")
    recordings, out = tmp_path / "recordings", tmp_path / "identified"
    assert (
        run(["import", str(log), "--map", str(tmp_path / "map.toml"), "-o", str(recordings)]) == 0
    )
    files = sorted(map(str, recordings.glob("*.parquet")))
    plain = tmp_path / "exoid.toml"
    plain.write_text("[identify]\nfigures = false\n", encoding="utf-8")
    assert run(["identify", *files, "-o", str(out), "--config", str(plain)]) == 0
    table = PARAMETERS.read(out / "parameters.parquet")
    assert table.metadata["joints"][1] == {
        "name": "elbow",
        "kind": "revolute",
        "drive": "none",
        "turns": True,
    }
    assert_allclose(table.frame["value"][:4], TRUTH[:4], rtol=0.03)
