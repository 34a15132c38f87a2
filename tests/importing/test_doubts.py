"""A guess is sure only where a wrong alternative was tried and lost."""

import tomllib

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from exoid_cli.app import run
from pipelines.importing.guess.torque import fit_torque
from pipelines.importing.naming.meaning import meaning
from pipelines.importing.quantities.wraparound import full_at, sign_bit
from pipelines.signals.filler import fill_value
from tests.importing.test_guess import guessed

__all__ = ["guessed"]


def counts_of(pendulum):
    """The pendulum's angle in the counts of an encoder of 12 bits."""
    return np.round(pendulum.angle * 4096 / (2.0 * np.pi)).astype(int)


def with_bit(counts, bit):
    return np.where(counts < 0, -counts | 1 << bit, counts)


def test_joints_with_names_of_rotations_have_their_own_moments(guessed, pendulum, write_csv):
    """Names as OpenSim writes them."""
    columns = {
        "time": pendulum.time,
        "hip_flexion_r": 50.0 * pendulum.angle,
        "knee_angle_r": 50.0 * np.roll(pendulum.angle, 200),
        "hip_flexion_r_moment": pendulum.torque,
        "knee_angle_r_moment": np.roll(pendulum.torque, 200),
    }
    text, _ = guessed(write_csv(columns))
    joints = [(j["angle"]["column"], j["torque"]["column"]) for j in tomllib.loads(text)["joint"]]
    assert joints == [
        ("hip_flexion_r", "hip_flexion_r_moment"),
        ("knee_angle_r", "knee_angle_r_moment"),
    ]


def test_an_angle_after_another_joint_may_count_from_the_vertical(guessed, pendulum, write_csv):
    columns = {"time": pendulum.time}
    for k, name in enumerate(("hip", "knee")):
        columns[f"{name}_angle"] = np.roll(pendulum.angle, 200 * k)
        columns[f"{name}_torque"] = np.roll(pendulum.torque, 200 * k)
    _, doubts = guessed(write_csv(columns))
    assert "from the vertical" not in doubts["joint[0].angle.zero"]
    assert "from the vertical" in doubts["joint[1].angle.zero"]


def test_a_last_line_of_text_leaves_a_clock_of_dates(guessed, pendulum, write_csv):
    stamps = pd.Timestamp("2026-03-04 11:59:57") + pd.to_timedelta(pendulum.time, unit="s")
    path = write_csv(pendulum.columns() | {"time": stamps.strftime("%I:%M:%S.%f %p")})
    path.write_text(path.read_text() + "end of log,,,\n")
    text, _ = guessed(path)
    assert tomllib.loads(text)["time"] == {"column": "time", "unit": "iso8601"}


def test_seconds_and_milliseconds_in_two_columns_are_proposed_as_one_clock(
    guessed, pendulum, write_csv
):
    counts = np.rint(1e3 * pendulum.time).astype(np.int64)
    columns = pendulum.columns() | {"time": 1_770_000_000 + counts // 1000, "frac": counts % 1000}
    text, _ = guessed(write_csv(columns))
    assert tomllib.loads(text)["time"] == {
        "column": "time",
        "unit": "s",
        "plus": "frac",
        "plus_unit": "ms",
    }


def test_a_moment_of_another_joint_than_the_angle_is_unsure(guessed, pendulum, write_csv):
    columns = {"time": pendulum.time, "knee_angle": pendulum.angle, "hip_moment": pendulum.torque}
    _, doubts = guessed(write_csv(columns))
    assert doubts["joint[0].torque.column"].startswith("its name says hip, the angle's knee")


@pytest.mark.parametrize(
    ("angle", "torque", "doubtful"),
    [
        ("output angle [deg]", "motor torque [Nm]", {"torque"}),
        ("knee angle [deg]", "knee motor torque [Nm]", {"torque"}),
        ("motor angle [deg]", "output torque [Nm]", {"angle"}),
        ("motor angle [deg]", "motor torque [Nm]", set()),
        ("angle [deg]", "torque [Nm]", set()),
    ],
)
def test_a_gear_may_lie_between_a_motor_and_what_is_not_named_so(
    guessed, pendulum, write_csv, angle, torque, doubtful
):
    columns = {angle: np.degrees(pendulum.angle), torque: pendulum.torque}
    text, doubts = guessed(write_csv({"time": pendulum.time} | columns))
    joint = tomllib.loads(text)["joint"][0]
    for quantity in ("angle", "torque"):
        is_doubtful = f"joint[0].{quantity}.gear_ratio" in doubts
        assert is_doubtful == ("gear_ratio" in joint[quantity]) == (quantity in doubtful)


def test_a_turn_of_an_electrical_angle_is_in_doubt(guessed, pendulum, write_csv):
    columns = {"electrical angle [deg]": np.degrees(4.0 * pendulum.angle) % 360.0}
    columns = {"time": pendulum.time} | columns | {"torque [Nm]": pendulum.torque}
    _, doubts = guessed(write_csv(columns))
    assert "for each pair of poles: set scale = 1 / pairs" in doubts["joint[0].angle.unit"]


def test_one_of_several_columns_that_names_do_not_tell_apart_is_unsure(
    guessed, pendulum, write_csv
):
    columns = {"time": pendulum.time, "motor angle": pendulum.angle, "angle": 2.0 * pendulum.angle}
    _, doubts = guessed(write_csv(columns | {"torque": pendulum.torque}))
    assert doubts["joint[0].angle.column"] == "no name shows which, rather than angle"


def test_a_measured_current_goes_before_a_commanded_torque(guessed, pendulum, write_csv):
    columns = {
        "time": pendulum.time,
        "angle": pendulum.angle,
        "target_torque": pendulum.torque,
        "motor_current_A": 2.0 * pendulum.torque,
    }
    text, _ = guessed(write_csv(columns))
    assert tomllib.loads(text)["joint"][0]["torque"]["column"] == "motor_current_A"


def test_joints_that_rest_while_another_moves_are_left_out_and_said(guessed, pendulum, write_csv):
    noise = 1e-4 * np.random.default_rng(1).normal(size=len(pendulum.time))
    columns = {
        "time": pendulum.time,
        "hip_angle": noise,
        "hip_torque": 3.0 + noise,
        "knee_angle": pendulum.angle,
        "knee_torque": pendulum.torque,
    }
    text, doubts = guessed(write_csv(columns))
    assert [joint["name"] for joint in tomllib.loads(text)["joint"]] == ["knee"]
    assert doubts["joint"].startswith("hip rest while others move, and are left out")


def test_a_register_of_magnitude_and_sign_is_proposed_and_imports_the_truth(
    imported, guessed, pendulum, write_csv
):
    counts = counts_of(pendulum)
    columns = {
        "time": pendulum.time,
        "position": with_bit(counts, 15),
        "torque": with_bit(np.round(100.0 * pendulum.torque).astype(int), 10),
    }
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert "wraps_at" not in text
    assert {"joint[0].angle.sign_bit", "joint[0].torque.sign_bit"} <= doubts.keys()
    text = text.replace("# counts_per_turn = ", "counts_per_turn = 4096 ")
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["joint_angle_rad"], counts[: len(frame)] * 2.0 * np.pi / 4096)


def test_an_import_without_the_sign_bit_says_that_there_is_one(imported, pendulum, write_csv):
    columns = pendulum.columns() | {
        "torque": with_bit(np.round(100 * pendulum.torque).astype(int), 10)
    }
    outcome = imported(write_csv(columns))
    assert "kept; set sign_bit = 10 if that is so" in outcome.printed


def test_a_counter_never_reads_more_than_its_modulus(pendulum):
    counts = counts_of(pendulum)
    assert full_at(counts % 4096.0, ()) == 4096.0
    assert full_at(with_bit(counts, 15).astype(float), ()) is None
    assert sign_bit(with_bit(counts, 15)) == 15
    # Two's complement has readings up to the last.
    assert sign_bit(counts % 65536) is None


@pytest.mark.parametrize(
    "encode",
    [
        lambda counts: (counts + 2048) ^ ((counts + 2048) >> 1),
        lambda counts: np.array([int(str(count + 2048), 16) for count in counts]),
        lambda counts: counts.astype(np.float32).view(np.uint32).astype(np.int64),
    ],
    ids=["Gray", "BCD", "bits of float32"],
)
def test_an_encoding_that_is_not_known_is_unsure(guessed, pendulum, write_csv, encode):
    columns = {"time": pendulum.time, "position": encode(counts_of(pendulum))}
    text, doubts = guessed(write_csv(columns | {"torque_Nm": pendulum.torque}))
    assert "jumps from row to row" in doubts["joint[0].angle.unit"]
    assert "signed_bits" not in text or "joint[0].angle.signed_bits" in doubts


def test_whole_numbers_may_be_hundredths_of_a_degree(guessed, pendulum, write_csv):
    columns = {"time": pendulum.time, "position": np.round(np.degrees(pendulum.angle) * 100.0)}
    _, doubts = guessed(write_csv(columns | {"torque": pendulum.torque}))
    assert "parts of a degree" in doubts["joint[0].angle.unit"]


def test_units_that_only_agree_with_each_other_are_both_unsure(guessed, pendulum, write_csv):
    """Degrees and degrees per second agree as radians do, on a swing of one degree."""
    columns = pendulum.columns() | {"angle": pendulum.angle, "velocity": pendulum.velocity}
    _, doubts = guessed(write_csv(columns))
    assert {"joint[0].angle.unit", "joint[0].velocity.unit"} <= doubts.keys()


def test_a_single_sine_explains_any_torque_of_its_period_and_shows_no_sign(pendulum):
    angle = np.sin(4.0 * pendulum.time)
    unrelated = np.sin(4.0 * pendulum.time - 1.0)
    fit = fit_torque(pendulum.time, angle, unrelated)
    assert fit.explained > 0.8 and fit.rival > 0.8 and not fit.proves
    assert fit_torque(pendulum.time, pendulum.angle, pendulum.torque).proves


def test_a_value_for_missing_readings_gets_a_range(imported, guessed, pendulum, write_csv):
    torque = pendulum.torque.copy()
    torque[::10] = -999.0
    path = write_csv(pendulum.columns() | {"torque": torque})
    assert "is exactly -999 in 200 rows" in imported(path).printed
    text, doubts = guessed(path)
    low, high = tomllib.loads(text)["joint"][0]["torque"]["range"]
    assert -3.0 < low < high < 3.0 and "joint[0].torque.range" in doubts


def test_a_reading_at_the_end_of_its_range_stands_for_no_missing_one(pendulum):
    assert fill_value(np.clip(pendulum.torque, -1.0, 1.0)) is None
    assert fill_value(np.where(pendulum.time > 9.0, 1e30, pendulum.torque)) == 1e30


def test_channels_with_clocks_of_their_own_are_guessed_with_them(pendulum, tmp_path, capsys):
    """An oscilloscope's pairs, of which the torque has half the rate."""
    half = [*pendulum.time[::2], *[np.nan] * (len(pendulum.time) // 2)]
    torque = [*pendulum.torque[::2], *[np.nan] * (len(pendulum.time) // 2)]
    rows = zip(pendulum.time, pendulum.angle, half, torque, strict=True)
    lines = ["Angle [rad],,Torque [Nm],", "X,Y,X,Y", *(",".join(map(str, row)) for row in rows)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines).replace("nan", ""))
    assert run(["import", str(path), "--guess"]) == 0
    proposed = tomllib.loads(capsys.readouterr().out)
    assert proposed["time"]["column"] == "Torque [Nm] [X]"
    assert proposed["joint"][0]["angle"]["time"] == "Angle [rad] [X]"
    assert proposed["joint"][0]["angle"]["unit"] == "rad"


def test_an_angle_that_is_blank_where_the_torque_is_logged_is_interpolated(
    imported, guessed, pendulum, write_csv
):
    """Two rates in one table, whose rows have the one or the other."""
    even = np.arange(len(pendulum.time)) % 2 == 0
    columns = {
        "time_s": pendulum.time,
        "angle_rad": np.where(even, pendulum.angle, np.nan),
        "torque_Nm": np.where(even, np.nan, pendulum.torque),
    }
    path = write_csv(columns)
    path.write_text(path.read_text().replace("nan", ""))
    text, _ = guessed(path)
    assert tomllib.loads(text)["joint"][0]["angle"]["time"] == "time_s"
    frame = imported(path, map_text=text).recording("log_train").frame
    assert len(frame) > 650
    truth = pendulum.angle[1::2][: len(frame)]
    assert_allclose(frame["joint_angle_rad"], truth, atol=1e-3)


@pytest.mark.parametrize(
    ("angle", "torque"),
    [
        ("Position [0.01 deg]", "Torque [0.1 Nm]"),
        ("Position [deg/100]", "Torque [Nm/10]"),
        ("Position_deg_x100", "Torque_Nm_x10"),
        ("Position [1e-2 deg]", "Torque [dNm]"),
        ("Position_cdeg", "Torque_dNm"),
        ("Position [pi rad]", "Torque [kilo Nm]"),
        ("Position_half_turns", "Torque [tenths of Nm]"),
    ],
)
def test_a_unit_with_a_factor_or_a_prefix_is_not_read_as_the_unit_alone(
    guessed, pendulum, write_csv, angle, torque
):
    columns = {"time": pendulum.time, angle: 100.0 * np.degrees(pendulum.angle)}
    _, doubts = guessed(write_csv(columns | {torque: 10.0 * pendulum.torque}))
    assert {"joint[0].angle.unit", "joint[0].torque.unit"} <= doubts.keys()


def test_a_factor_in_a_name_is_given_with_the_keys_to_set(guessed, pendulum, write_csv):
    columns = {
        "Time [0.1 ms]": np.round(1e4 * pendulum.time).astype(int),
        "Position [deg]": np.degrees(pendulum.angle),
        "Torque [0.1 Nm]": 10.0 * pendulum.torque,
    }
    _, doubts = guessed(write_csv(columns))
    assert "its name says '0.1 ms': 200 Hz" in doubts["time.unit"]
    assert "its name says '0.1 Nm': set unit and scale" in doubts["joint[0].torque.unit"]


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [("tick_100us", "us", 100.0), ("cycle_500us", "us", 500.0), ("Time [0.1 ms]", "ms", 0.1)],
)
def test_the_duration_of_a_tick_in_a_name_is_proposed_and_imports_the_truth(
    imported, guessed, pendulum, write_csv, name, unit, scale
):
    count_s = scale * {"us": 1e-6, "ms": 1e-3}[unit]
    path = write_csv(
        {
            name: np.round(pendulum.time / count_s).astype(int) + 123_456,
            "angle_rad": pendulum.angle,
            "torque_Nm": pendulum.torque,
        }
    )
    text, doubts = guessed(path)
    assert tomllib.loads(text)["time"] == {"column": name, "unit": unit, "scale": scale}
    assert "its name says" in doubts["time.unit"]
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


def test_a_tick_with_its_duration_next_to_a_clock_of_the_same_times_is_no_rival(
    guessed, pendulum, write_csv
):
    ticks = np.round(pendulum.time * 1e4).astype(int)
    text, doubts = guessed(write_csv(pendulum.columns() | {"tick_100us": ticks}))
    assert tomllib.loads(text)["time"]["column"] == "time"
    assert "tick_100us" not in doubts.get("time.column", "")


@pytest.mark.parametrize("name", ["speed_10ms", "axis_1_us", "q1_s"])
def test_a_number_before_a_unit_of_time_is_no_tick_in_other_names(name):
    assert not meaning(name).unread


@pytest.mark.parametrize("gon", ["gon", "grad"])
def test_a_unit_that_no_map_has_is_quoted_and_no_joints_name(guessed, pendulum, write_csv, gon):
    columns = {
        "time": pendulum.time,
        f"phi [{gon}]": 200.0 / np.pi * pendulum.angle,
        "M [oz-in]": 141.6 * pendulum.torque,
    }
    text, doubts = guessed(write_csv(columns))
    assert tomllib.loads(text)["joint"][0]["name"] == "joint"
    assert f"its name says {gon!r}" in doubts["joint[0].angle.unit"]
    assert "its name says 'oz-in'" in doubts["joint[0].torque.unit"]


@pytest.mark.parametrize("name", ["winkel_grad", "winkel [Grad]"])
def test_grad_in_lower_case_is_a_degree_in_doubt(guessed, pendulum, write_csv, name):
    columns = {"time": pendulum.time, name: np.degrees(pendulum.angle), "tau_Nm": pendulum.torque}
    text, doubts = guessed(write_csv(columns))
    assert tomllib.loads(text)["joint"][0]["angle"]["unit"] == "deg"
    assert ("gon" in doubts.get("joint[0].angle.unit", "")) == (name == "winkel_grad")


def test_a_unit_that_no_map_has_is_read_without_brackets_too(guessed, pendulum, write_csv):
    gon = 200.0 / np.pi
    log = {
        "time_s": pendulum.time,
        "phi_gon": gon * pendulum.angle,
        "omega_gon_s": gon * pendulum.velocity,
        "torque_Nm": pendulum.torque,
    }
    text, doubts = guessed(write_csv(log))
    assert "its name says 'gon'" in doubts["joint[0].angle.unit"]
    assert "its name says 'gon/s'" in doubts["joint[0].velocity.unit"]
    assert tomllib.loads(text)["joint"][0]["name"] == "joint"


@pytest.mark.parametrize(("in_turn", "is_gon"), [(400.0, True), (360.0, False)])
def test_a_velocity_in_rad_shows_that_grad_is_a_gon(guessed, pendulum, write_csv, in_turn, is_gon):
    columns = {
        "time": pendulum.time,
        "winkel_grad": pendulum.angle * in_turn / (2.0 * np.pi),
        "omega_rad_s": pendulum.velocity,
        "tau_Nm": pendulum.torque,
    }
    _, doubts = guessed(write_csv(columns))
    assert ("set scale = 0.9" in doubts["joint[0].angle.unit"]) == is_gon


@pytest.mark.parametrize("name", ["tau_PI [Nm]", "pi_controller_torque [Nm]", "half_angle [rad]"])
def test_a_word_before_no_unit_is_no_factor(name):
    column = meaning(name)
    assert column.unit and not column.unread


@pytest.mark.parametrize("begin", ["2026-03-04 12:00:00", "2026-03-04 23:59:57"])
def test_a_time_of_day_and_its_milliseconds_are_proposed_together(
    imported, guessed, pendulum, write_csv, begin
):
    """As FactoryTalk writes them: Date, Time and Millitm."""
    stamps = pd.Timestamp(begin) + pd.to_timedelta(pendulum.time, unit="s")
    columns = {
        "Date": stamps.strftime("%m/%d/%Y"),
        "Time": stamps.strftime("%H:%M:%S"),
        "Millitm": stamps.microsecond // 1000,
        "angle": pendulum.angle,
        "torque": pendulum.torque,
    }
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert tomllib.loads(text)["time"] == {
        "column": "Time",
        "unit": "iso8601",
        "plus": "Millitm",
        "plus_unit": "ms",
    }
    assert not any(key.startswith("time.") for key in doubts)
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


def ended(values):
    """Every fourth value in the first rows, and no others."""
    return [*map(str, values[::4]), *[""] * (len(values) - len(values[::4]))]


def blank(values):
    """Every fourth value, and no others between."""
    return ["" if row % 4 else str(value) for row, value in enumerate(values)]


def held(values):
    """Every fourth value, repeated until the next."""
    return np.repeat(values[::4], 4)[: len(values)]


@pytest.mark.parametrize("slow", [ended, blank, held])
def test_of_two_clocks_in_one_table_the_slower_is_proposed(
    imported, guessed, pendulum, write_csv, slow
):
    """Between the rows of the faster one, straight lines would make the angle rough."""
    columns = {
        "daq_time_s": pendulum.time,
        "daq_torque_Nm": pendulum.torque,
        "enc_time_s": slow(pendulum.time + 0.002),
        "enc_angle_rad": slow(pendulum.angle),
    }
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert tomllib.loads(text)["time"]["column"] == "enc_time_s"
    (joint,) = tomllib.loads(text)["joint"]
    assert joint["torque"]["time"] == "daq_time_s" and "time" not in joint["angle"]
    assert "time_offset_s at the channels of daq_time_s" in doubts["time.column"]
    frame = imported(path, map_text=text).recording("log_train").frame
    at_s = frame["time_s"].to_numpy() + 0.002
    torque = np.interp(at_s, pendulum.time, pendulum.torque)
    assert_allclose(frame["joint_torque_nm"], torque, atol=1e-9)


def test_a_slower_clock_of_no_angle_or_torque_is_not_proposed(guessed, pendulum, write_csv):
    columns = pendulum.columns() | {
        "warm_time_s": held(pendulum.time + 0.002),
        "motor temperature": held(20.0 + pendulum.angle),
    }
    time = tomllib.loads(guessed(write_csv(columns))[0])["time"]
    assert time["column"] == "time"


def test_the_sign_of_a_torque_is_unsure_where_its_column_is(guessed, pendulum, write_csv):
    """Without names, another joint's motion explains a torque with the opposite sign, too."""
    columns = {
        "a": pendulum.time,
        "b": pendulum.angle,
        "c": pendulum.velocity,
        "d": -pendulum.torque,
    }
    text, doubts = guessed(write_csv(columns))
    assert tomllib.loads(text)["joint"][0]["torque"]["sign"] == -1
    assert {"joint[0].torque.column", "joint[0].torque.sign"} <= doubts.keys()


def test_a_joint_whose_torque_is_zero_throughout_is_proposed_as_passive(
    guessed, pendulum, write_csv
):
    """As ROS writes the effort of a joint without a drive."""
    columns = {"time": pendulum.time}
    for k in (0, 1):
        columns[f"position{k}"] = np.roll(pendulum.angle, 200 * k)
        columns[f"effort{k}"] = (1 - k) * pendulum.torque
    text, doubts = guessed(write_csv(columns))
    first, second = tomllib.loads(text)["joint"]
    assert first["torque"]["column"] == "effort0" and "drive" not in first
    assert second["drive"] == "none" and "torque" not in second
    assert "effort1 is 0 throughout" in doubts["joint[1].drive"]


def test_a_joint_whose_commanded_torque_is_zero_is_not_proposed_as_passive(
    guessed, pendulum, write_csv
):
    """Another loop may drive it."""
    columns = {"time": pendulum.time}
    for k in (0, 1):
        columns[f"position{k}"] = np.roll(pendulum.angle, 200 * k)
    columns |= {"effort0": pendulum.torque, "effort_cmd1": 0.0 * pendulum.torque}
    text, doubts = guessed(write_csv(columns))
    assert "joint[1].drive" not in doubts and 'drive = "none"' not in text


def test_a_clock_that_wraps_around_after_whole_hours_is_proposed_and_unsure(
    guessed, pendulum, write_csv
):
    columns = pendulum.columns() | {"time": (35996.0 + pendulum.time) % 36000.0}
    text, doubts = guessed(write_csv(columns))
    assert tomllib.loads(text)["time"]["wraps_at"] == 36000.0
    assert "time.restarts" in doubts["time.wraps_at"]


@pytest.mark.parametrize(
    ("first", "second", "named"),
    [
        ("Trial 1", "Trial 2", "trial_1, trial_2 may be runs or"),
        ("run1", "run2", "run_1, run_2 may be runs or"),
        ("avg", "max", "avg, max may be runs or"),
        ("hip max", "hip avg", "hip_max, hip_avg may be runs or"),
        ("hip max", "knee max", ""),
        ("trial 1 hip", "trial 1 knee", ""),
        ("1", "2", ""),
    ],
)
def test_columns_of_runs_or_statistics_are_in_doubt_as_joints(
    guessed, pendulum, write_csv, first, second, named
):
    """As in a workbook with the runs of a machine side by side, or a logger's table of means."""
    columns = {"Time (s)": pendulum.time}
    for k, name in enumerate((first, second)):
        columns[f"{name} angle (deg)"] = np.degrees(np.roll(pendulum.angle, 300 * k))
        columns[f"{name} torque (Nm)"] = np.roll(pendulum.torque, 300 * k)
    text, doubts = guessed(write_csv(columns))
    assert len(tomllib.loads(text)["joint"]) == 2
    assert ("joint.name" in doubts) == bool(named)
    assert named in doubts.get("joint.name", "")


def test_a_name_that_pandas_numbered_is_the_same_name_twice(guessed, pendulum, write_csv):
    columns = pendulum.columns()
    columns = {"time [s]": columns["time"]} | {
        f"{name}{twin}": np.roll(columns[quantity], 300 * k)
        for k, twin in enumerate(("", ".1"))
        for name, quantity in (("angle [rad]", "angle"), ("torque [Nm]", "torque"))
    }
    text, doubts = guessed(write_csv(columns))
    assert len(tomllib.loads(text)["joint"]) == 1
    assert doubts["joint[0].angle.column"] == "no name shows which, rather than angle [rad].1"
