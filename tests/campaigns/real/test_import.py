"""The logs that other people made import with the maps that exoid brings, and say what is wrong
with them."""

import numpy as np
import pandas as pd
import pytest

from exoid_cli.app import run
from pipelines.contracts import RECORDING
from pipelines.settings.datasets import datasets


@pytest.fixture
def imported(real_data, tmp_path, capsys):
    def call(pattern: str, map_name: str):
        files = sorted(str(file) for file in real_data.glob(pattern))
        code = run(
            ["import", *files, "--map", str(datasets() / "maps" / map_name), "-o", str(tmp_path)]
        )
        captured = capsys.readouterr()
        assert (code, captured.err) == (0, "")
        tables = {path.stem: RECORDING.read(path) for path in sorted(tmp_path.glob("*.parquet"))}
        return tables, " ".join(captured.out.split())

    return call


def test_the_axis_of_emps_has_the_force_of_its_benchmark(imported):
    """35.1507 N for a volt of the controller, at most 4.33 V (the README of the data)."""
    tables, _ = imported("emps/*.mat", "emps.toml")
    table = tables["DATA_EMPS"]
    assert [(joint.name, joint.kind) for joint in table.joints] == [("axis", "prismatic")]
    assert (len(table.frame), table.metadata["sample_rate_hz"]) == (24841, 1000.0)
    assert table.frame["axis_force_n"].min() == pytest.approx(-35.1507 * 4.325662, rel=1e-5)
    assert tables["DATA_EMPS_PULSES"].metadata["purpose"] == "validate"


def test_the_double_pendulum_keeps_its_irregular_instants(imported):
    tables, messages = imported(
        "double_pendulum/A0_fourier_75s.csv", "double_pendulum_fourier.toml"
    )
    train, validate = tables["A0_fourier_75s_train"], tables["A0_fourier_75s_validate"]
    assert len(train.frame) + len(validate.frame) == 21969
    assert "irregular: 21% of the steps" in messages
    assert train.metadata["geometry"] == {"thigh_length_m": 0.3, "gravity_m_s2": 9.81}


def test_each_swing_of_the_double_pendulum_is_a_recording(imported):
    tables, _ = imported("double_pendulum/A0_swing_*.csv", "double_pendulum.toml")
    assert [table.metadata["purpose"] for table in tables.values()] == ["train"] * 3 + ["validate"]


def test_the_swing_ups_of_the_simple_pendulum(imported):
    tables, _ = imported("simple_pendulum/*.csv", "simple_pendulum.toml")
    ranges = [np.ptp(table.frame["pivot_angle_rad"]) for table in tables.values()]
    assert min(ranges) > np.pi  # each gets upright


def test_currents_of_the_xl330_get_their_sign_back(imported):
    tables, messages = imported("xl330/*.json", "xl330.toml")
    assert len(tables) == 16
    assert "a signed register of 16 bits logged without its sign" in messages
    # 1.5 A is what the servo's data sheet has it stall at.
    assert (
        max(np.abs(table.frame["pivot_torque_nm"]).max() for table in tables.values()) < 0.59 * 1.6
    )
    warm = [table.frame["pivot_temperature_c"].max() for table in tables.values()]
    assert max(warm) >= 40.0


def test_what_is_wrong_with_the_logs_of_modexo_is_reported(imported):
    tables, messages = imported("modexo/*.csv", "modexo.toml")
    assert "clock starts over at row 5, 136.573 s back" in messages
    assert "that 32 bits cannot hold, the first 4294967300" in messages
    assert "that 16 bits cannot hold, the first 630040" in messages
    assert "rows put in order" in messages
    assert tables["20170712-loadcellTests_2_train"].metadata["imported"]["rows_in_source"] == 22803


@pytest.mark.parametrize(
    ("pattern", "map_name", "joints"),
    [
        ("simple_pendulum/*.csv", "simple_pendulum.toml", {"joint": "pivot"}),
        (
            "double_pendulum/A0_fourier_75s.csv",
            "double_pendulum_fourier.toml",
            {"joint1": "shoulder", "joint2": "elbow"},
        ),
    ],
)
def test_a_guess_of_a_real_log_says_what_its_map_says(
    real_data, tmp_path, capsys, pattern, map_name, joints
):
    files = sorted(str(file) for file in real_data.glob(pattern))
    guess = tmp_path / "guess.toml"
    assert run(["import", *files, "--guess", "--map", str(guess)]) == 0
    for path, folder in ((guess, "guessed"), (datasets() / "maps" / map_name, "known")):
        assert run(["import", *files, "--map", str(path), "-o", str(tmp_path / folder)]) == 0
    capsys.readouterr()
    # Where a log is to be cut it does not say: all of it is compared.
    known, guessed = (
        pd.concat(
            [RECORDING.read(path).frame for path in sorted((tmp_path / folder).glob("*.parquet"))]
        )
        for folder in ("known", "guessed")
    )
    guessed.columns = [_renamed(name, joints) for name in guessed.columns]
    np.testing.assert_array_equal(known[sorted(known.columns)], guessed[sorted(guessed.columns)])


def _renamed(column: str, joints: dict[str, str]) -> str:
    for guessed, known in joints.items():
        if column.startswith(f"{guessed}_"):
            return column.replace(guessed, known, 1)
    return column


def test_a_guess_of_the_xl330_asks_for_its_torque_constant(real_data, tmp_path, capsys):
    file = str(real_data / "xl330" / "2026-01-15_10h28m10.json")
    assert run(["import", file, "--guess", "--map", str(tmp_path / "guess.toml")]) == 0
    assert "fill in: joint[0].torque.torque_constant_nm_a" in capsys.readouterr().out
    text = (tmp_path / "guess.toml").read_text(encoding="utf-8")
    assert "make 2^12 of a turn in rad" in text  # the servo's encoder has 4096 steps
    assert "signed_bits = 16" in text
    (tmp_path / "guess.toml").write_text(
        text.replace("# torque_constant_nm_a =", "torque_constant_nm_a = 0.59 #")
    )
    assert run(["import", file, "--map", str(tmp_path / "guess.toml"), "-o", str(tmp_path)]) == 0


@pytest.mark.parametrize(
    ("pattern", "map_name"),
    [
        ("emps/*.mat", "emps.toml"),
        ("double_pendulum/A0_fourier_75s.csv", "double_pendulum_fourier.toml"),
        ("double_pendulum/A0_swing_*.csv", "double_pendulum.toml"),
        ("double_pendulum/C1*.csv", "double_pendulum_C1.toml"),
        ("simple_pendulum/*.csv", "simple_pendulum.toml"),
        ("xl330/*.json", "xl330.toml"),
    ],
)
def test_no_channel_of_a_sound_log_is_taken_for_a_magnitude_or_leaps(imported, pattern, map_name):
    _, messages = imported(pattern, map_name)
    assert "turns round" not in messages
    assert "leaps" not in messages
