"""A guess is right where it is sure, says where it is not, and runs as it is."""

import json
import re
import tomllib
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.io import savemat

from exoid_cli.app import run
from pipelines.importing.guess.counting import lost_sign
from pipelines.importing.naming.meaning import meaning
from pipelines.importing.quantities.consistency import integral_agreement

pytestmark = pytest.mark.long


@pytest.fixture
def guessed(tmp_path, capsys):
    """Let exoid propose a map for files; its text, and what is doubtful by its key."""

    def call(*files):
        path = tmp_path / "guess.toml"
        assert run(["import", *map(str, files), "--guess", "--map", str(path), "--json"]) == 0, (
            capsys.readouterr().err
        )
        printed = json.loads(capsys.readouterr().out)
        return path.read_text(encoding="utf-8"), {
            doubt["key"]: doubt["why"] for doubt in printed["doubts"]
        }

    return call


def swinging(pendulum):
    """The pendulum's columns on a wide swing: gravity shows where down is."""
    angle = 2.0 * pendulum.angle
    velocity = 2.0 * pendulum.velocity
    acceleration = np.gradient(velocity, pendulum.time)
    torque = 0.05 * acceleration + 2.0 * np.sin(angle) + 0.2 * np.tanh(velocity / 0.01)
    return {"time": pendulum.time, "angle": angle, "velocity": velocity, "torque": torque}


def test_a_named_clock_that_counts_milliseconds_is_no_counter_of_rows(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    text, _ = guessed(write_csv({"time_ms": np.arange(2000)} | dict(list(columns.items())[1:])))
    assert re.search(r'^column = "time_ms".*\nunit = "ms"', text, flags=re.MULTILINE), text


@pytest.mark.parametrize(
    ("names", "factors"),
    [
        (("time", "position", "velocity", "torque"), (1, 1, 1, 1)),
        (("t_ms", "pos_meas1", "vel_meas1", "tau_meas1"), (1e3, 1, 1, -1)),
        (
            ("Time (us)", "Angle [deg]", "Speed [rpm]", "Torque [Nm]"),
            (1e6, 180 / np.pi, 30 / np.pi, 1),
        ),
        (("stamp", "pos", "vel", "tau"), (1e9, 180 / np.pi, 30 / np.pi, 1)),
        (("clock", "q", "omega", "effort"), (1e3, 180 / np.pi, 180 / np.pi, 1)),
        (("a", "b", "c", "d"), (1, 1, 1, 1)),
    ],
    ids=lambda value: str(value[0]),
)
def test_a_guess_imports_the_truth(imported, guessed, pendulum, write_csv, names, factors):
    columns = swinging(pendulum)
    logged = {
        name: factor * values
        for name, factor, values in zip(names, factors, columns.values(), strict=True)
    }
    path = write_csv(logged)
    text, _ = guessed(path)
    outcome = imported(path, map_text=text)
    assert (outcome.code, outcome.err) == (0, "")
    name = re.search(r'name = "(\w+)"', text)[1]
    frame = outcome.recording("log_train").frame
    rows = len(frame)
    assert_allclose(frame["time_s"], pendulum.time[:rows], atol=1e-9)
    assert_allclose(frame[f"{name}_angle_rad"], columns["angle"][:rows], rtol=1e-9, atol=1e-9)
    assert_allclose(
        frame[f"{name}_velocity_rad_s"], columns["velocity"][:rows], rtol=1e-9, atol=1e-9
    )
    assert_allclose(frame[f"{name}_torque_nm"], columns["torque"][:rows], rtol=1e-9, atol=1e-9)


def test_a_clock_too_coarse_for_its_rows_gives_their_rate(imported, guessed, pendulum, write_csv):
    """Stamps in whole hundredths of a second, of rows that are 5 ms apart."""
    path = write_csv(swinging(pendulum) | {"time": np.floor(100.0 * pendulum.time) / 100.0})
    text, doubts = guessed(path)
    assert "rate_hz = 200.0" in text and "one stamp of time" in doubts["time.rate_hz"]
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


def test_a_pause_as_long_as_the_log_changes_no_rate_and_is_reported(guessed, pendulum, write_csv):
    paused = pendulum.time + 10.0 * (pendulum.time >= 5.0)
    text, doubts = guessed(
        write_csv(swinging(pendulum) | {"time": np.floor(100.0 * paused) / 100.0})
    )
    assert "rate_hz = 200.0" in text
    assert "none came for 10 s" in doubts["time.rate_hz"]


def test_stamps_with_three_and_four_rows_by_turns_give_the_rate_of_both(
    guessed, pendulum, write_csv
):
    stamps = np.arange(2000) * 3 // 10 / 100.0
    text, doubts = guessed(write_csv(swinging(pendulum) | {"time": stamps}))
    assert tomllib.loads(text)["time"]["rate_hz"] == pytest.approx(1000.0 / 3.0, rel=2e-3)
    assert "none came" not in doubts["time.rate_hz"]


def test_a_coarse_clock_whose_stamps_have_few_rows_and_many_by_turns_gives_no_rate(
    pendulum, write_csv, capsys
):
    stamps = np.repeat(np.arange(400) / 50.0, np.tile([2, 8], 200))
    path = write_csv(swinging(pendulum) | {"time": stamps})
    assert run(["import", str(path), "--guess"]) == 2
    assert "no time column found" in capsys.readouterr().err


@pytest.mark.parametrize("stamps", ["numbers", "dates"])
def test_a_fine_clock_without_a_name_goes_before_a_coarse_one_of_its_rate_that_has_one(
    imported, guessed, pendulum, write_csv, stamps
):
    coarse = np.floor(pendulum.time)
    if stamps == "dates":
        dates = pd.Timestamp("2026-03-01 12:00:00") + pd.to_timedelta(coarse, unit="s")
        coarse = np.array(dates.strftime("%Y-%m-%d %H:%M:%S"))
    path = write_csv(swinging(pendulum) | {"time": coarse, "x": 1e6 * pendulum.time})
    text, doubts = guessed(path)
    assert tomllib.loads(text)["time"] == {"column": "x", "unit": "us"} and "time.column" in doubts
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


def test_what_rises_at_another_rate_than_a_coarse_clock_does_not_take_its_place(
    guessed, pendulum, write_csv
):
    others = {
        "index": 2 * np.arange(2000),
        "x": 1e3 * pendulum.time**2,
        "part": 1e6 * pendulum.time % 1e6,
    }
    text, _ = guessed(
        write_csv(swinging(pendulum) | {"time": np.floor(100.0 * pendulum.time) / 100.0} | others)
    )
    assert tomllib.loads(text)["time"] == {"rate_hz": 200.0}


def test_what_names_do_not_say_is_unsure(guessed, pendulum, write_csv):
    _, doubts = guessed(write_csv(dict(zip("abcd", swinging(pendulum).values(), strict=True))))
    assert {
        "joint[0].angle.column",
        "joint[0].angle.unit",
        "joint[0].torque.column",
        "time.column",
    } <= doubts.keys()
    assert "integrates to it" in doubts["joint[0].angle.column"]


def test_a_speed_in_another_unit_than_the_angles_integrates_to_all_of_it(
    guessed, pendulum, write_csv
):
    columns, factors = swinging(pendulum), (1, 180 / np.pi, 30 / np.pi, 1)
    names = ("Time (s)", "Angle [deg]", "Speed [rpm]", "Torque [Nm]")
    logged = {
        name: factor * values
        for name, factor, values in zip(names, factors, columns.values(), strict=True)
    }
    printed = re.search(r"integrates to ([\d.]+) of the angle", guessed(write_csv(logged))[0])
    assert float(printed[1]) == pytest.approx(1.0, abs=0.01)


def test_units_in_names_leave_no_doubt(guessed, pendulum, write_csv):
    names = ("Time (s)", "Angle (deg)", "Speed (deg/s)", "Torque (Nm)")
    columns = swinging(pendulum)
    columns |= {"angle": np.degrees(columns["angle"]), "velocity": np.degrees(columns["velocity"])}
    text, doubts = guessed(write_csv(dict(zip(names, columns.values(), strict=True))))
    assert doubts.keys() == {"geometry.gravity_m_s2"}
    angle = tomllib.loads(text)["joint"][0]["angle"]
    assert (angle["unit"], angle["zero"]) == ("deg", 0.0)


def test_gravity_shows_where_down_is(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    text, doubts = guessed(write_csv(columns | {"angle": columns["angle"] + 0.8}))
    assert tomllib.loads(text)["joint"][0]["angle"]["zero"] == pytest.approx(0.8, abs=0.05)
    assert "would hang" in doubts["joint[0].angle.zero"]


def test_an_encoders_steps_show_its_unit(guessed, pendulum, write_csv):
    """4096 steps in a turn are 4096 in one unit only."""
    columns = swinging(pendulum)
    degrees = np.round(np.degrees(columns["angle"]) * 4096 / 360) * 360 / 4096
    text, doubts = guessed(
        write_csv(columns | {"angle": degrees, "velocity": np.degrees(columns["velocity"])})
    )
    assert "make 2^12 of a turn in deg" in text
    assert "joint[0].angle.unit" not in doubts


def test_a_torque_that_does_not_follow_the_motion_is_doubtful(guessed, pendulum, write_csv):
    noise = np.random.default_rng(1).normal(size=len(pendulum.time))
    _, doubts = guessed(write_csv(swinging(pendulum) | {"torque": noise}))
    assert "of the torque, and" in doubts["joint[0].torque.sign"]


def test_a_velocity_of_another_joint_is_doubtful(guessed, pendulum, write_csv):
    other = np.cos(7.0 * pendulum.time)
    _, doubts = guessed(write_csv(swinging(pendulum) | {"velocity": other}))
    assert "does not integrate to the angle" in doubts["joint[0].velocity.unit"]


def test_a_current_needs_a_torque_constant_that_no_log_holds(
    imported, guessed, pendulum, write_csv
):
    columns = swinging(pendulum)
    columns["Current (mA)"] = np.round(1e4 * columns.pop("torque")).astype(int) % 65536
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert "signed_bits = 16" in text
    assert "joint[0].torque.torque_constant_nm_a" in doubts
    refused = imported(path, map_text=text)
    assert (refused.code, "torque.unit: needs torque_constant_nm_a" in refused.err) == (2, True)
    filled = text.replace("# torque_constant_nm_a = ", "torque_constant_nm_a = 0.1")
    assert imported(path, map_text=filled).code == 0


def test_a_voltage_on_a_joint_that_may_slide_names_both_gains(guessed, tmp_path):
    time = np.arange(4000) / 1000.0
    place = 0.2 * np.sin(2.0 * time)
    path = tmp_path / "slide.mat"
    savemat(path, {"t": time, "qm": place, "vir": 2.0 * np.cos(2.0 * time), "gtau": 35.15})
    text, _ = guessed(path)
    assert re.search(r"# gain_nm_v = +# FILL IN: .*; gain_n_v if it slides", text)
    assert "Not used: gtau = 35.15" in text


def test_what_changes_with_the_kind_of_a_joint_is_reported_where_nothing_says_that_it_turns(
    guessed, tmp_path
):
    time = np.arange(4000) / 1000.0
    place = 0.2 * np.sin(2.0 * time)
    path = tmp_path / "slide.mat"
    savemat(path, {"t": time, "qm": place, "qg": place + 1e-3, "vir": 2.0 * np.cos(2.0 * time)})
    _, doubts = guessed(path)
    assert (
        doubts["joint[0].kind"]
        == 'no unit of length; if it slides and the log is in metres: kind = "prismatic",'
        ' angle.unit = "m", reference.unit = "m", gain_n_v in place of gain_nm_v, gravity_m_s2 ='
        " 0 if it lies level"
    )


@pytest.mark.parametrize("name", ["torque_enable", "servo_on", "drive_enabled"])
def test_a_column_of_0_and_1_that_says_whether_the_drive_is_on_is_proposed(
    imported, guessed, pendulum, write_csv, name
):
    on = np.ones(len(pendulum.time))
    on[:50] = 0.0
    path = write_csv(swinging(pendulum) | {name: on})
    text, doubts = guessed(path)
    assert re.search(
        rf'^enabled = "{name}" +# from its name; 0 in 2.5% of the rows: where it is 0 ',
        text,
        re.M,
    )
    assert "joint[0].enabled" not in doubts
    assert "Not used" not in text
    assert len(imported(path, map_text=text).recording("log_train").frame) == 0.7 * len(on) - 50


@pytest.mark.parametrize("values", [0.0, 7.0], ids=["never on", "a number"])
def test_a_column_that_is_no_switch_is_not_proposed_whatever_its_name(
    guessed, pendulum, write_csv, values
):
    text, _ = guessed(
        write_csv(swinging(pendulum) | {"torque_enable": np.full(len(pendulum.time), values)})
    )
    assert "enabled =" not in text
    assert "Not used: torque_enable" in text


def test_every_joint_has_its_own_switch_or_that_of_all(guessed, pendulum, write_csv):
    one, on = swinging(pendulum), np.ones(len(pendulum.time))
    joints = {
        f"{joint}_{what}": one[what]
        for joint in ("hip", "knee")
        for what in ("angle", "velocity", "torque")
    }
    switches = {"enabled": on, "knee_enabled": on}
    text, _ = guessed(write_csv({"time": pendulum.time} | joints | switches))
    assert [joint["enabled"] for joint in tomllib.loads(text)["joint"]] == [
        "enabled",
        "knee_enabled",
    ]


def test_several_joints_are_distinguished_and_never_sure_of_their_signs(
    guessed, pendulum, write_csv
):
    one = swinging(pendulum)
    columns = {"time": one["time"]}
    for joint in ("hip", "knee"):
        columns |= {f"{joint}_{name}": one[name] for name in ("angle", "velocity", "torque")}
    columns["hip_torque_cmd"] = one["torque"]
    text, doubts = guessed(write_csv(columns))
    joints = tomllib.loads(text)["joint"]
    assert [joint["name"] for joint in joints] == ["hip", "knee"]
    assert joints[0]["torque"]["column"] == "hip_torque"
    assert {
        "joint[0].torque.sign",
        "joint[1].torque.sign",
        "geometry.thigh_length_m",
    } <= doubts.keys()


def test_a_clock_that_was_full_is_counted_on(imported, guessed, pendulum, write_csv):
    ticks = (np.round(pendulum.time * 1e6).astype(np.int64) + 2**32 - 4_000_000) % 2**32
    path = write_csv(swinging(pendulum) | {"time": ticks})
    text, _ = guessed(path)
    assert "wraps_at = 4294967296" in text
    assert len(imported(path, map_text=text).recording("log_train").frame) == 1400


def test_several_files_train_and_validate_as_a_whole(guessed, pendulum, write_csv):
    files = [write_csv(swinging(pendulum), name=f"run{k}.csv") for k in range(3)]
    recordings = tomllib.loads(guessed(*files)[0])["recording"]
    assert [(one["files"], one["purpose"]) for one in recordings] == [
        ("run0.csv", "train"),
        ("run1.csv", "train"),
        ("run2.csv", "validate"),
    ]


def test_a_guess_never_overwrites_a_map(pendulum, write_csv, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    assert run(["import", str(write_csv(pendulum.columns())), "--guess", "--map", str(path)]) == 2
    assert "exists already, not overwritten" in capsys.readouterr().err
    assert path.read_text() == "precious"


def test_without_a_map_one_is_offered(pendulum, write_csv, capsys):
    assert run(["import", str(write_csv(pendulum.columns()))]) == 2
    assert "--guess --map MAP.toml` proposes one" in capsys.readouterr().err


def test_a_log_in_which_nothing_moves_gets_no_guess(pendulum, write_csv, capsys):
    path = write_csv({"time": pendulum.time, "x": np.zeros(2000), "y": np.ones(2000)})
    assert run(["import", str(path), "--guess"]) == 2
    assert "no angle column found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "quantity", "joint", "unit"),
    [
        ("q_dot", "velocity", "", None),
        ("knee_theta_ddot", "acceleration", "knee", None),
        ("pos_meas1", "angle", "1", None),
        ("hip_angle_rad", "angle", "hip", "rad"),
        ("pivot.position", "angle", "pivot", None),
        ("EPOSCurrent ()", "current", "", None),
        ("Time (ms)", "time", "", "ms"),
        ("goal_position", "reference", "", None),
        ("LoadCell ()", "", "", None),
        ("torque_enable", "enabled", "", None),
        ("hip.servo_on", "enabled", "hip", None),
        ("DriveEnabled", "enabled", "", None),
        ("enable_count", "", "", None),
        ("on", "", "", None),
        ("tau_con1", "torque", "1", None),
        ("Motor Speed [1/min]", "velocity", "", "rpm"),
        ("q[1]", "angle", "1", None),
        ("torque_mNm", "torque", "", "mN·m"),
        ("Iq_mA", "current", "", "mA"),
        ("I_q (mA)", "current", "", "mA"),
        ("I_q", "current", "", None),
        ("I_d [A]", "", "", None),
        ("Lage Motor (Inkr.)", "angle", "", "counts"),
        ("Drehzahl Motor [1/min]", "velocity", "", "rpm"),
        ("n / (1/min)", "velocity", "", "rpm"),
        ("Strom Hüfte [mA]", "current", "hip", "mA"),
        ("Motorstrom in A", "current", "", "A"),
        ("motor_A", "current", "", "A"),
        ("joint_A", "", "a", None),
        ("Kniewinkel (°)", "angle", "knee", "deg"),
        ("Drehzahlistwert_U/min", "velocity", "", "rpm"),
        ("Sollwinkel [Grad]", "reference", "", "deg"),
        ("Schleppfehler [Inkr]", "", "", None),
        ("Zwischenkreisspannung [V]", "", "", None),
        ("Kraft [N]", "force", "", "N"),
        ("Weg [mm]", "angle", "", "mm"),
        ("vitesse moteur (tr/min)", "velocity", "", "rpm"),
        ("Couple_mesuré_N.m", "torque", "", "N·m"),
        ("Courant [mA]", "current", "", "mA"),
        ("hip_velocity_rad_s", "velocity", "hip", "rad/s"),
        ("accel_rad_s2", "", "", None),
        ("motor_torque_pct", "torque", "", "%"),
        ("encoder_ticks", "angle", "", "counts"),
        ("sys_ticks", "", "", None),
        ("xref_mm", "reference", "x", "mm"),
        ("qdes", "reference", "", None),
        ("reset", "", "reset", None),
        ("T_C", "temperature", "", "°C"),
        ("theta_m", "angle", "", None),
        ("q_min", "angle", "min", None),
        ("speed_ms", "velocity", "ms", None),
        ("current_position", "angle", "", None),
        ("Current Position [deg]", "angle", "", "deg"),
    ],
)
def test_names_show_quantity_joint_and_unit(name, quantity, joint, unit):
    column = meaning(name)
    assert (column.quantity, column.unit) == (quantity, unit)
    if quantity:
        assert column.joint == joint


@pytest.mark.parametrize(
    ("name", "joint"),
    [
        ("x_counts", "x"),
        ("motor_counts", "joint"),
        ("ticks", "joint"),
        ("Ist Inkremente", "joint"),
        ("impulsions moteur", "joint"),
        ("knee_ticks", "knee"),
        ("points", "joint"),
    ],
)
def test_counts_are_an_angle_where_nothing_else_is(guessed, pendulum, write_csv, name, joint):
    counts = np.round(1000.0 * pendulum.angle).astype(int) + 2000
    columns = {
        "time_us": pendulum.time * 1e6,
        name: counts,
        "cmd_counts": counts + 1,
        "iq_mA": pendulum.torque,
    }
    text, doubts = guessed(write_csv(columns))
    (joint_table,) = tomllib.loads(text)["joint"]
    assert (joint_table["name"], joint_table["angle"]["column"], joint_table["angle"]["unit"]) == (
        joint,
        name,
        "counts",
    )
    assert (joint_table["reference"]["column"], joint_table["torque"]["column"]) == (
        "cmd_counts",
        "iq_mA",
    )
    assert doubts["joint[0].angle.column"] == "no name contains angle, but this column is in counts"


@pytest.mark.parametrize(
    "name",
    [
        *("adc_counts", "torque_counts", "error_counts", "loop_ticks", "sample_count"),
        *("delta_counts", "enc_delta", "angle_delta_deg", "pos diff", "sin_theta"),
    ],
)
def test_counts_of_something_else_are_no_angle(pendulum, write_csv, capsys, name):
    path = write_csv(
        {"t_s": pendulum.time, name: np.round(1000.0 * pendulum.angle), "iq_mA": pendulum.torque}
    )
    assert run(["import", str(path), "--guess"]) == 2
    assert "no angle column found" in capsys.readouterr().err


def test_counts_that_never_go_back_are_no_angle(pendulum, write_csv, capsys):
    ticks = np.arange(len(pendulum.time)) * 3
    path = write_csv({"t_s": pendulum.time, "ticks": ticks, "iq_mA": pendulum.torque})
    assert run(["import", str(path), "--guess"]) == 2
    assert "no angle column found" in capsys.readouterr().err


def test_counts_give_way_to_a_column_that_is_called_an_angle(guessed, pendulum, write_csv):
    counts = np.round(1000.0 * pendulum.angle).astype(int)
    text, _ = guessed(write_csv(swinging(pendulum) | {"ticks": counts}))
    assert tomllib.loads(text)["joint"][0]["angle"]["column"] == "angle"


def test_a_register_without_its_sign_is_known_by_the_hole_in_its_middle():
    rng = np.random.default_rng(1)
    current = np.round(rng.normal(0.0, 500.0, 5000))
    assert lost_sign(current % 65536) == 16
    assert lost_sign(current % 2**32) == 32
    assert lost_sign(np.abs(current)) is None
    assert lost_sign(np.round(rng.uniform(0.0, 65535.0, 5000))) is None


def test_a_slip_in_a_column_does_not_hide_it(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    angle = columns["angle"].astype(object)
    angle[77] = "ERR"
    text, _ = guessed(write_csv(columns | {"angle": angle}))
    assert tomllib.loads(text)["joint"][0]["angle"]["column"] == "angle"


@pytest.mark.parametrize("value", ["", "nan", "inf"])
def test_a_column_without_a_number_makes_neither_a_part_nor_a_noise(
    guessed, pendulum, write_csv, value
):
    """Of numpy's warnings the suite makes errors."""
    text, _ = guessed(write_csv(swinging(pendulum) | {"hip_angle": [value] * len(pendulum.time)}))
    assert tomllib.loads(text)["joint"][0]["angle"]["column"] == "angle"


def test_a_clock_that_misses_its_first_stamp_is_one_all_the_same(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    columns["time"] = ["", *columns["time"][1:]]
    assert tomllib.loads(guessed(write_csv(columns))[0])["time"]["column"] == "time"


@pytest.mark.parametrize("unit", ["us", "ms"])
def test_a_log_of_a_moment_gets_a_guess_without_a_sign(guessed, pendulum, write_csv, unit):
    """A window in which a torque could be compared with the motion is longer than all of it."""
    columns = swinging(pendulum)
    names = {
        "time": f"t [{unit}]",
        "angle": "angle [deg]",
        "velocity": "speed [rpm]",
        "torque": "torque [Nm]",
    }
    columns = {names[name]: values[:60] for name, values in columns.items()}
    assert "joint[0].torque.sign" in guessed(write_csv(columns))[1]


def test_a_clock_in_whose_unit_no_machine_is_sampled_is_doubted_whatever_its_name_says(
    guessed, pendulum, write_csv
):
    columns = swinging(pendulum)
    columns["t [ms]"] = columns.pop("time")
    assert "no usual rate: is it s?" in guessed(write_csv(columns))[1]["time.unit"]


def test_a_leg_is_a_leg_in_other_languages(guessed, pendulum, write_csv):
    one = swinging(pendulum)
    columns = {"Zeit [s]": one["time"]}
    for joint in ("Hüfte", "Knie"):
        columns |= {
            f"Winkel {joint} [°]": np.degrees(one["angle"]),
            f"Strom {joint} [mA]": 1e3 * one["torque"],
        }
    joints = tomllib.loads(guessed(write_csv(columns))[0])["joint"]
    assert [joint["name"] for joint in joints] == ["hip", "knee"]


def test_a_single_sine_is_not_taken_for_its_own_velocity(guessed, pendulum, write_csv):
    """The integral of a sine is a cosine, but a negative one."""
    time = pendulum.time
    angle, velocity = np.sin(2.0 * time), 2.0 * np.cos(2.0 * time)
    text, _ = guessed(
        write_csv(
            {"a": time, "b": velocity, "c": angle, "d": np.sin(angle) + 0.2 * np.sign(velocity)}
        )
    )
    joint = tomllib.loads(text)["joint"][0]
    assert (joint["angle"]["column"], joint["velocity"]["column"]) == ("c", "b")


def test_rows_without_a_clock_get_no_guess(pendulum, write_csv, capsys):
    columns = pendulum.columns()
    del columns["time"]
    assert run(["import", str(write_csv(columns)), "--guess"]) == 2
    assert "with time.rate_hz where rows are uniform" in capsys.readouterr().err


def test_joint_states_of_ros_are_guessed_too(imported, guessed, pendulum, bag):
    text, doubts = guessed(bag)
    assert "joint[0].kind" in doubts  # a message of a slide looks the same, in metres and newtons
    outcome = imported(bag, map_text=text)
    assert (outcome.code, outcome.err) == (0, "")
    frame = outcome.recording("bag_train").frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[: len(frame)], atol=1e-12)
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


HEADERS = {
    "deg_s": ("t_s", "angle_deg", "speed_deg/s", "torque_mNm"),
    "German": ("Zeit [s]", "Lage Gelenk (Grad)", "Drehzahl [Grad/s]", "Moment [mNm]"),
    "French": ("Temps (s)", "Position angulaire [°]", "Vitesse [°/s]", "Couple (mN.m)"),
}


@pytest.mark.parametrize("names", HEADERS.values(), ids=HEADERS)
def test_a_unit_in_a_header_is_believed_and_imports_the_truth(
    imported, guessed, pendulum, write_csv, names
):
    factors = (1.0, 180.0 / np.pi, 180.0 / np.pi, 1e3)
    columns = zip(names, factors, swinging(pendulum).values(), strict=True)
    path = write_csv({name: factor * values for name, factor, values in columns})
    text, doubts = guessed(path)
    assert doubts.keys() == {"geometry.gravity_m_s2"}
    (torque,) = (
        values
        for name, values in imported(path, map_text=text).recording("log_train").frame.items()
        if name.endswith("_torque_nm")
    )
    assert_allclose(torque, swinging(pendulum)["torque"][: len(torque)], rtol=1e-9, atol=1e-9)


def test_a_drives_log_of_a_motor_before_its_gear_leads_to_the_joint(
    imported, guessed, pendulum, write_csv
):
    """Counts, revolutions and milliamperes of a motor: what its log cannot tell is asked for, the
    rest is right."""
    columns = swinging(pendulum)
    counts = np.round(columns["angle"] / (2.0 * np.pi) * 50 * 4096).astype(int)
    path = write_csv(
        {
            "Zeit [ms]": np.round(1e3 * pendulum.time).astype(int),
            "Lage Motor (Inkr.)": counts,
            "Drehzahl Motor [1/min]": columns["velocity"] * 50 * 30.0 / np.pi,
            "I_q (mA)": columns["torque"] / (0.08 * 50) * 1e3,
        },
        delimiter=";",
        decimal=",",
    )
    text, doubts = guessed(path)
    assert "by the velocity 4096 in its turn" in doubts["joint[0].angle.counts_per_turn"]
    assert {
        f"joint[0].{what}.gear_ratio" for what in ("angle", "velocity", "torque")
    } <= doubts.keys()
    assert "joint[0].torque.unit" not in doubts
    filled = text.replace("# counts_per_turn =", "counts_per_turn = 4096 #").replace(
        "gear_ratio = 1.0", "gear_ratio = 50"
    )
    outcome = imported(
        path, map_text=filled.replace("# torque_constant_nm_a =", "torque_constant_nm_a = 0.08 #")
    )
    assert (outcome.code, outcome.err) == (0, "")
    frame = outcome.recording("log_train").frame
    assert_allclose(frame["joint_torque_nm"], columns["torque"][: len(frame)], atol=1e-9)
    assert_allclose(frame["joint_angle_rad"], columns["angle"][: len(frame)], atol=1e-4)
    assert "integrates to" not in outcome.printed


COUNTED = {
    "revolute": (
        {
            "counts_per_turn": "counts_per_turn = 4096",
            "torque_constant_nm_a": "torque_constant_nm_a = 0.1",
        },
        ("joint_reference_rad", "joint_angle_rad", 2.0 * np.pi / 4096),
    ),
    "prismatic": (
        {
            "counts_per_turn": "counts_per_m = 50000",
            "torque_constant_nm_a": "force_constant_n_a = 2.0",
        },
        ("joint_reference_m", "joint_position_m", 1.0 / 50000),
    ),
}
"""What is filled in of a joint of each kind, its columns and what a count is in them."""


@pytest.mark.parametrize("kind", COUNTED)
def test_a_map_of_counts_imports_once_all_that_was_asked_for_is_filled_in(
    imported, guessed, pendulum, write_csv, kind
):
    """Set-point and speed come from the same encoder as the angle, and need what it needs."""
    columns, (answers, (reference, angle, count)) = swinging(pendulum), COUNTED[kind]
    counts = np.round(columns["angle"] / (2.0 * np.pi) * 4096).astype(int)
    path = write_csv(
        {
            "time_us": np.round(1e6 * pendulum.time).astype(int),
            "pos_counts": counts,
            "ref_counts": counts + 3,
            "speed [counts/s]": columns["velocity"] / (2.0 * np.pi) * 4096,
            "iq_mA": np.round(1e4 * columns["torque"]),
        }
    )
    text, doubts = guessed(path)
    of = ("angle", "velocity", "reference")
    assert {
        f"joint[0].{one}.{key}" for one in of for key in ("counts_per_turn", "gear_ratio")
    } <= doubts.keys()
    assert "counts_per_m if it slides" in doubts["joint[0].reference.counts_per_turn"]
    filled = text.replace('"revolute"', f'"{kind}"')
    for key, answer in answers.items():
        filled = filled.replace(f"# {key} =", f"{answer} #")
    outcome = imported(path, map_text=filled)
    assert (outcome.code, outcome.err) == (0, "")
    frame = outcome.recording("log_train").frame
    assert_allclose(frame[reference] - frame[angle], 3 * count, atol=1e-9)


SIGNED = {
    "pos_counts": "angle",
    "speed [counts/s]": "velocity",
    "ref_counts": "reference",
    "iq_mA": "torque",
}


@pytest.mark.parametrize(
    "unsigned",
    [
        [*SIGNED],
        *(
            pytest.param([name], marks=pytest.mark.slow if name != "iq_mA" else ())
            for name in SIGNED
        ),
    ],
    ids=lambda names: "+".join(names),
)
def test_a_sign_that_was_lost_is_found_again_whatever_lost_it(
    imported, guessed, pendulum, write_csv, unsigned
):
    columns, per_rad = swinging(pendulum), 4096 / (2.0 * np.pi)
    logged = {
        "time_us": np.round(1e6 * pendulum.time),
        "pos_counts": np.round(per_rad * columns["angle"]),
        "speed [counts/s]": np.round(per_rad * columns["velocity"]),
        "ref_counts": np.round(per_rad * columns["angle"]) + 3,
        "iq_mA": np.round(1e3 * columns["torque"]),
    }
    logged = {name: values.astype(int) for name, values in logged.items()}
    path = write_csv(
        {name: values % 65536 if name in unsigned else values for name, values in logged.items()}
    )
    text, _ = guessed(path)
    joint = tomllib.loads(text)["joint"][0]
    assert [
        quantity for quantity in SIGNED.values() if joint[quantity].get("signed_bits") == 16
    ] == [SIGNED[name] for name in unsigned]
    for key, answer in COUNTED["revolute"][0].items():
        text = text.replace(f"# {key} =", f"{answer} #")
    frame = imported(path, map_text=text).recording("log_train").frame
    for name, factor, (column, values) in zip(
        ("angle_rad", "velocity_rad_s", "reference_rad", "torque_nm"),
        (per_rad, per_rad, per_rad, 1e4),
        list(logged.items())[1:],
        strict=True,
    ):
        assert_allclose(
            frame[f"joint_{name}"], values[: len(frame)] / factor, atol=1e-9, err_msg=column
        )


def test_a_set_point_in_counts_with_an_angle_in_mm_asks_for_those_in_a_metre(
    guessed, pendulum, write_csv
):
    place = 40.0 * pendulum.angle
    columns = {
        "t_s": pendulum.time,
        "pos_mm": place,
        "ref_counts": np.round(1e3 * place),
        "force_N": pendulum.torque,
    }
    text, doubts = guessed(write_csv(columns))
    assert tomllib.loads(text)["joint"][0]["reference"]["unit"] == "counts"
    assert "joint[0].reference.counts_per_m" in doubts


def test_a_slides_current_asks_for_the_force_of_its_motor(imported, guessed, pendulum, write_csv):
    columns = {
        "t_s": pendulum.time,
        "pos_mm": 40.0 * pendulum.angle,
        "motor_mA": np.round(1e3 * pendulum.torque),
    }
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert "lead_m if it turns a screw" in doubts["joint[0].torque.force_constant_n_a"]
    filled = text.replace("# force_constant_n_a =", "force_constant_n_a = 24.0 #")
    assert imported(path, map_text=filled).code == 0


def test_a_motors_speed_with_a_joints_angle_shows_the_gear(imported, guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    path = write_csv(
        {
            "t_s": pendulum.time,
            "knee_angle_deg": np.degrees(columns["angle"]),
            "knee_motor_speed_rpm": columns["velocity"] * 50 * 30.0 / np.pi * 1.004,
            "knee_motor_A": columns["torque"] / (0.08 * 50),
        }
    )
    text, doubts = guessed(path)
    assert text.count("gear_ratio = 50.0") == 2
    assert (
        "as of a motor that turns 50 times for one turn of the joint"
        in doubts["joint[0].velocity.unit"]
    )
    assert {"joint[0].velocity.gear_ratio", "joint[0].torque.gear_ratio"} <= doubts.keys()
    outcome = imported(
        path, map_text=text.replace("# torque_constant_nm_a =", "torque_constant_nm_a = 0.08 #")
    )
    assert (outcome.code, outcome.err) == (0, "")
    frame = outcome.recording("log_train").frame
    assert_allclose(frame["knee_torque_nm"], columns["torque"][: len(frame)], atol=1e-9)
    assert_allclose(
        frame["knee_velocity_rad_s"], 1.004 * columns["velocity"][: len(frame)], atol=1e-9
    )


def test_json_records_with_an_index_that_has_no_name_are_read(guessed, pendulum, tmp_path):
    path = tmp_path / "log.json"
    columns = {"": np.arange(len(pendulum.time))} | pendulum.columns()
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    path.write_text(
        json.dumps([dict(zip(columns, row, strict=True)) for row in rows]), encoding="utf-8"
    )
    text, _ = guessed(path)
    assert 'column = "angle"' in text


@pytest.mark.parametrize("delimiter", ["^", "~", "&", "\x01"])
def test_a_guess_reads_what_is_written_with_any_delimiter(guessed, pendulum, write_csv, delimiter):
    text, doubts = guessed(write_csv(pendulum.columns(), delimiter=delimiter))
    assert 'column = "angle"' in text
    assert "joint[0].angle.column" not in doubts


def test_a_current_without_a_unit_is_doubtful_for_the_reason_that_is_given(
    guessed, pendulum, write_csv
):
    columns = swinging(pendulum)
    torque = columns.pop("torque")
    whole = guessed(write_csv(columns | {"motor current": np.round(100.0 * torque)}))
    (write_csv(columns).parent / "guess.toml").unlink()
    broken = guessed(write_csv(columns | {"motor current": torque}))
    assert [tomllib.loads(text)["joint"][0]["torque"]["unit"] for text, _ in (whole, broken)] == [
        "mA",
        "A",
    ]
    assert "whole numbers, as drives log mA" in whole[1]["joint[0].torque.unit"]
    assert "no name has its unit" in broken[1]["joint[0].torque.unit"]


def test_a_torque_that_no_joints_drive_delivers_is_doubted_by_the_guess_and_reported_by_the_import(
    imported, guessed, pendulum, write_csv
):
    columns = swinging(pendulum)
    columns["Torque (Nm)"] = 1e4 * columns.pop("torque")
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert re.search(
        r"\d+(\.\d+)?e\+04 N·m is too much for a drive: is it mN·m\?",
        doubts["joint[0].torque.unit"],
    )
    printed = imported(path, map_text=text).printed
    assert (
        "N·m, expected at most about 1000 N·m of a drive; kept; check its unit (is it mN·m?)"
        in printed
    )
    right = imported(path, map_text=text.replace('unit = "N·m"', 'unit = "mN·m"'))
    assert "of a drive" not in right.printed


def test_an_angle_that_no_joint_reaches_is_doubted_whatever_its_name_says(
    guessed, pendulum, write_csv
):
    columns = swinging(pendulum)
    columns["angle_rad"] = np.degrees(columns.pop("angle"))
    _, doubts = guessed(write_csv(columns))
    assert "turns, so check unit and gear_ratio" in doubts["joint[0].angle.unit"]


def test_a_share_of_what_a_drive_can_asks_for_what_that_is(imported, guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    columns["Moment [%]"] = 100.0 * columns.pop("torque") / 4.0
    path = write_csv(columns)
    text, doubts = guessed(path)
    assert "value of 100 %" in doubts["joint[0].torque.rated_torque_nm"]
    frame = (
        imported(path, map_text=text.replace("# rated_torque_nm =", "rated_torque_nm = 4.0 #"))
        .recording("log_train")
        .frame
    )
    assert_allclose(frame["joint_torque_nm"], swinging(pendulum)["torque"][: len(frame)], atol=1e-9)


def test_a_force_on_a_joint_that_turns_asks_for_another_column(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    columns["Kraft [N]"] = columns.pop("torque")
    _, doubts = guessed(write_csv(columns))
    assert "N is a unit of force" in doubts["joint[0].torque.unit"]


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2.0 * np.pi), ("rev", 1.0)])
def test_a_counter_that_wraps_around_is_counted_on(
    imported, guessed, pendulum, write_csv, unit, turn
):
    columns = swinging(pendulum)
    path = write_csv(columns | {"angle": columns["angle"] * turn / (2.0 * np.pi) % turn})
    angle = tomllib.loads(guessed(path)[0])["joint"][0]["angle"]
    assert (angle["unit"], angle["wraps_at"]) == (unit, turn)


@pytest.mark.parametrize(
    "form", ["%Y-%m-%d %H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%f+01:00", "%H:%M:%S.%f"]
)
def test_dates_and_times_of_day_are_a_clock(imported, guessed, pendulum, write_csv, form):
    columns = swinging(pendulum)
    stamps = pd.Timestamp("2026-03-01 12:00:00") + pd.to_timedelta(columns["time"], unit="s")
    path = write_csv(columns | {"time": np.array(stamps.strftime(form))})
    text, doubts = guessed(path)
    assert (
        tomllib.loads(text)["time"] == {"column": "time", "unit": "iso8601"}
        and "time.unit" not in doubts
    )
    time_s = imported(path, map_text=text).recording("log_train").frame["time_s"]
    assert_allclose(np.diff(time_s), 0.005, atol=1e-9)


@pytest.mark.parametrize(("unit", "factor"), [("mrad", 1e3), ("deg", 180 / np.pi)])
def test_the_sign_of_a_torque_is_seen_in_any_unit_of_angle(
    guessed, pendulum, write_csv, unit, factor
):
    columns = swinging(pendulum)
    path = write_csv(
        {
            "t": columns["time"],
            f"q [{unit}]": factor * columns["angle"],
            "tau [Nm]": -columns["torque"],
        }
    )
    text, doubts = guessed(path)
    assert (
        tomllib.loads(text)["joint"][0]["torque"]["sign"] == -1
        and "joint[0].torque.sign" not in doubts
    )


def test_angle_and_velocity_are_found_among_hundreds_of_columns_without_names_and_soon(
    guessed, pendulum, tmp_path, monkeypatch
):
    looked_at = Mock(side_effect=integral_agreement)
    monkeypatch.setattr("pipelines.importing.guess.joints.integral_agreement", looked_at)
    rng = np.random.default_rng(1)
    noise = {f"c{k}": rng.normal(size=len(pendulum.time)).cumsum() for k in range(200)}
    columns = {"time": pendulum.time} | noise | {"c77": pendulum.velocity, "c133": pendulum.angle}
    gappy = np.where(rng.random(len(pendulum.time)) < 0.05, np.nan, pendulum.angle)
    for number, angle in enumerate((pendulum.angle, gappy)):
        path = tmp_path / f"log{number}.parquet"
        pd.DataFrame(columns | {"c133": angle}).to_parquet(path)
        joint = tomllib.loads(guessed(path)[0])["joint"][0]
        (tmp_path / "guess.toml").unlink()
        assert (joint["angle"]["column"], joint["velocity"]["column"]) == ("c133", "c77")
    assert looked_at.call_count <= 2 * 100


def test_a_column_without_a_number_in_the_middle_of_a_long_log_hides_no_angle(
    guessed, pendulum, tmp_path, monkeypatch
):
    monkeypatch.setattr("pipelines.importing.quantities.consistency.MOST", 1000)
    rng, rows = np.random.default_rng(1), np.arange(len(pendulum.time))
    columns = {"time": pendulum.time} | {
        f"c{k}": rng.normal(size=len(rows)).cumsum() for k in range(25)
    }
    columns |= {"c3": pendulum.velocity, "c8": pendulum.angle}
    columns |= {
        "c5": np.where(rows < 9, rows**2, np.nan),
        "c6": np.where(rows % 999 < 2, rows, np.nan),
    }
    path = tmp_path / "log.parquet"
    pd.DataFrame(columns).to_parquet(path)
    joint = tomllib.loads(guessed(path)[0])["joint"][0]
    assert (joint["angle"]["column"], joint["velocity"]["column"]) == ("c8", "c3")


def test_a_refusal_of_a_log_of_thousands_of_columns_names_the_first(tmp_path, capsys):
    path = tmp_path / "wide.csv"
    row = ",".join(["1.5"] * 3000)
    path.write_text(",".join(f"c{k}" for k in range(3000)) + f"\n{row}" * 40, encoding="utf-8")
    assert run(["import", str(path), "--guess"]) == 2
    assert "c18, c19 and 2980 more increases" in capsys.readouterr().err


def test_a_second_log_of_one_row_is_guessed_without_a_period(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    whole = write_csv(columns, "a.csv")
    short = write_csv({name: values[:1] for name, values in columns.items()}, "b.csv")
    text, _ = guessed(whole, short)
    assert [one["files"] for one in tomllib.loads(text)["recording"]] == ["a.csv", "b.csv"]


def two_links(pendulum, first, second):
    """Return columns of two joints by the names of their quantities, ``first`` and ``second`` with
    a place for each."""
    columns = swinging(pendulum)
    joined = {"time": columns["time"]}
    for name, factor in ((first, 1.0), (second, -0.5)):
        for quantity in ("position", "velocity", "effort"):
            joined[name.format(quantity)] = (
                factor
                * columns[
                    "torque" if quantity == "effort" else quantity.replace("position", "angle")
                ]
            )
    return joined


def test_both_joints_of_a_state_within_a_record_are_found(guessed, pendulum, tmp_path):
    columns = swinging(pendulum)
    rows = [
        {
            "stamp": t,
            "state": {"q": [q, -0.5 * q], "dq": [v, -0.5 * v]},
            "cmd": {"tau": [tau, -0.5 * tau]},
        }
        for t, q, v, tau in zip(*columns.values(), strict=True)
    ]
    path = tmp_path / "log.json"
    path.write_text(json.dumps(rows), encoding="utf-8")
    joints = tomllib.loads(guessed(path)[0])["joint"]
    assert [joint["angle"]["column"] for joint in joints] == ["state.q[0]", "state.q[1]"]
    assert [joint["velocity"]["column"] for joint in joints] == ["state.dq[0]", "state.dq[1]"]


@pytest.mark.parametrize(
    ("first", "second", "order", "doubted"),
    [
        ("elbow.{}", "shoulder.{}", ["shoulder", "elbow"], False),
        ("r_knee_{}", "r_hip_{}", ["r_hip", "r_knee"], False),
        ("azimuth.{}", "lever.{}", ["azimuth", "lever"], True),
        ("joint1.{}", "joint2.{}", None, False),
    ],
)
def test_which_joint_carries_which_is_read_off_names_or_doubted(
    guessed, pendulum, write_csv, first, second, order, doubted
):
    text, doubts = guessed(write_csv(two_links(pendulum, first, second)))
    joints = tomllib.loads(text)["joint"]
    assert ("joint" in doubts) == doubted
    if order:
        assert [joint["name"] for joint in joints] == order
    else:
        assert [joint["angle"]["column"] for joint in joints] == [
            "joint1.position",
            "joint2.position",
        ]


def test_what_slides_is_taken_for_level_by_the_guess(guessed, pendulum, write_csv):
    columns = swinging(pendulum)
    text, doubts = guessed(
        write_csv(
            {"t": columns["time"], "pos_mm": 100 * columns["angle"], "F_N": columns["torque"]}
        )
    )
    assert tomllib.loads(text)["geometry"] == {"gravity_m_s2": 0.0}
    assert "of a lift" in doubts["geometry.gravity_m_s2"]


def test_two_clocks_side_by_side_that_no_name_tells_each_get_their_channels(
    imported, guessed, pendulum, write_csv
):
    # Time, angle and torque of two loggers; the slower one's columns end at a quarter of the rows.
    slow = slice(0, None, 4)
    ended = {"lc_s": pendulum.time[slow], "lc_Nm": pendulum.torque[slow]}
    blank = [""] * (len(pendulum.time) - len(ended["lc_s"]))
    columns = {"enc_ms": 1e3 * pendulum.time, "enc_deg": np.degrees(pendulum.angle)}
    columns |= {name: [*values, *blank] for name, values in ended.items()}
    path = write_csv(columns)
    text, doubts = guessed(path)
    map_ = tomllib.loads(text)
    assert map_["time"]["column"] == "lc_s" and "time.column" in doubts
    assert map_["joint"][0]["angle"]["column"] == "enc_deg"
    assert map_["joint"][0]["angle"]["time"] == "enc_ms"
    assert map_["joint"][0]["torque"]["column"] == "lc_Nm"
    frame = imported(path, map_text=text).recording("log_train").frame
    rows = len(frame)
    assert_allclose(frame.filter(like="angle").iloc[:, 0], pendulum.angle[slow][:rows], atol=1e-9)
    assert_allclose(frame.filter(like="torque").iloc[:, 0], pendulum.torque[slow][:rows], atol=1e-9)
