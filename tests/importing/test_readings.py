"""A reading becomes the quantity at the joint: unit, sign, zero, registers, drive train."""

import json

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.importing.quantities.numbers import have_minutes
from pipelines.settings.units import UNITS
from tests.importing.conftest import MAP
from tests.importing.test_guess import guessed

__all__ = ["guessed"]

WRITTEN = [
    ("rad", 1.0, ""),
    ("deg", 180.0 / np.pi, ""),
    ("rev", 0.5 / np.pi, ""),
    ("mrad", 1e3, ""),
    ("counts", 4096 / (2 * np.pi), ", counts_per_turn = 4096"),
    ("counts", 50 * 4096 / (2 * np.pi), ", counts_per_turn = 4096, gear_ratio = 50"),
]


@pytest.mark.parametrize(("unit", "factor", "keys"), WRITTEN)
def test_angles_are_radians_at_the_joint(imported, pendulum, write_csv, unit, factor, keys):
    path = write_csv(pendulum.columns() | {"angle": factor * pendulum.angle})
    text = MAP.replace('column = "angle", unit = "rad"', f'column = "angle", unit = "{unit}"{keys}')
    assert_allclose(
        imported(path, map_text=text).recording().frame["pivot_angle_rad"],
        pendulum.angle,
        atol=1e-12,
    )


def test_sign_and_zero(imported, pendulum, write_csv):
    """A joint whose encoder says 30 degrees where it hangs down, and counts the other way."""
    path = write_csv(pendulum.columns() | {"angle": 30.0 - np.degrees(pendulum.angle)})
    text = MAP.replace(
        'column = "angle", unit = "rad"', 'column = "angle", unit = "deg", sign = -1, zero = 30.0'
    )
    assert_allclose(
        imported(path, map_text=text).recording().frame["pivot_angle_rad"],
        pendulum.angle,
        atol=1e-12,
    )


@pytest.mark.parametrize(
    ("unit", "factor", "keys"),
    [
        ("N·m", 1.0, ""),
        ("Nm", 1.0, ""),
        ("mN·m", 1e3 / 50, ", gear_ratio = 50"),
        ("A", 1 / (0.07 * 50), ", torque_constant_nm_a = 0.07, gear_ratio = 50"),
        ("mA", 1e3 / (0.07 * 50), ", torque_constant_nm_a = 0.07, gear_ratio = 50"),
        ("V", 1 / 2.5, ", gain_nm_v = 2.5"),
        ("permille", 1e3 / (1.2 * 50), ", rated_torque_nm = 1.2, gear_ratio = 50"),
        ("kgf·cm", 1 / 0.0980665, ""),
    ],
)
def test_torque_is_what_the_drive_delivers_at_the_joint(
    imported, pendulum, write_csv, unit, factor, keys
):
    path = write_csv(pendulum.columns() | {"torque": factor * pendulum.torque})
    text = MAP.replace(
        'column = "torque", unit = "N·m"', f'column = "torque", unit = "{unit}"{keys}'
    )
    assert_allclose(
        imported(path, map_text=text).recording().frame["pivot_torque_nm"],
        pendulum.torque,
        atol=1e-12,
    )


def test_a_screw_turns_torque_into_force_and_turns_into_travel(imported, pendulum, write_csv):
    """What a motor does, 2 pi x torque a turn, is what the slide does, lead x force: power is the
    same."""
    columns = pendulum.columns()
    text = MAP.replace('name = "pivot"', 'name = "axis"\nkind = "prismatic"')
    text = text.replace('unit = "rad" }', 'unit = "rad", lead_m = 0.005 }')
    text = text.replace('unit = "rad/s" }', 'unit = "rad/s", lead_m = 0.005 }')
    text = text.replace('unit = "N·m" }', 'unit = "N·m", lead_m = 0.005 }')
    table = imported(write_csv(columns), map_text=text).recording()
    power = table.frame["axis_force_n"] * table.frame["axis_velocity_m_s"]
    assert_allclose(power, pendulum.torque * pendulum.velocity, atol=1e-12)
    assert_allclose(table.frame["axis_position_m"], pendulum.angle * 0.005 / (2 * np.pi))
    assert [(joint.name, joint.kind) for joint in table.joints] == [("axis", "prismatic")]


def test_a_register_logged_without_its_sign_gets_it_back(imported, pendulum, write_csv):
    current = np.round(1e3 * pendulum.torque).astype(int)
    path = write_csv(pendulum.columns() | {"torque": current % 65536})
    text = MAP.replace('unit = "N·m"', 'unit = "mA", signed_bits = 16, torque_constant_nm_a = 1.0')
    outcome = imported(path, map_text=text)
    assert_allclose(outcome.recording().frame["pivot_torque_nm"], 1e-3 * current)
    assert "a signed register of 16 bits logged without its sign" in outcome.printed


def test_what_a_register_cannot_hold_is_missing(imported, pendulum, write_csv):
    """4.2949673e9 is more than 2^32: a small negative number whose last digits a float32 has
    lost."""
    counts = np.round(4096 / (2 * np.pi) * pendulum.angle).astype(np.int64)
    unsigned = (counts % 2**32).astype(object)
    unsigned[40] = "4.2949673E9"
    text = MAP.replace('unit = "rad"', 'unit = "counts", signed_bits = 32, counts_per_turn = 4096')
    outcome = imported(write_csv(pendulum.columns() | {"angle": unsigned}), map_text=text)
    assert_allclose(outcome.recording().metadata["gaps"], [[0.2, 1]])
    assert (
        "1 row that 32 bits cannot hold, the first 4294967300; taken for missing" in outcome.printed
    )


def test_an_encoder_that_wraps_is_counted_on(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns() | {"angle": np.degrees(pendulum.angle) % 360.0})
    text = MAP.replace('unit = "rad"', 'unit = "deg", wraps_at = 360.0', 1)
    outcome = imported(path, map_text=text)
    assert_allclose(
        np.diff(outcome.recording().frame["pivot_angle_rad"]), np.diff(pendulum.angle), atol=1e-12
    )
    assert "wraps at 360" in outcome.printed


def test_a_range_leaves_out_what_cannot_be(imported, pendulum, write_csv):
    torque = pendulum.torque.copy()
    torque[7] = 1e6
    text = MAP.replace('unit = "N·m"', 'unit = "N·m", range = [-100, 100]')
    outcome = imported(write_csv(pendulum.columns() | {"torque": torque}), map_text=text)
    assert len(outcome.recording().frame) == 1999
    assert "1 row outside -100 … 100; taken for missing" in outcome.printed


def test_expressions_are_arithmetic_with_columns(imported, pendulum, tmp_path):
    """The second link's absolute angle, and a controller's volts times a constant that stands in
    the file."""
    import scipy.io

    path = tmp_path / "log.mat"
    content = {
        "time": pendulum.time,
        "q1": np.cos(pendulum.time),
        "q2": pendulum.angle + np.cos(pendulum.time),
        "velocity": pendulum.velocity,
        "vir": pendulum.torque / 35.15,
        "gtau": 35.15,
    }
    scipy.io.savemat(path, content)
    text = MAP.replace('column = "angle"', 'expression = "q2 - q1"')
    text = text.replace('column = "torque"', 'expression = "gtau * vir"')
    frame = imported(path, map_text=text).recording().frame
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle, atol=1e-12)
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-12)


def test_names_with_blanks_stand_in_backquotes(imported, pendulum, write_csv):
    columns = pendulum.columns()
    columns["drive torque (Nm)"] = 2.0 * columns.pop("torque")
    text = MAP.replace('column = "torque"', 'expression = "-(-`drive torque (Nm)`) / 2"')
    frame = imported(write_csv(columns), map_text=text).recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-12)


def test_spans_of_one_file_become_recordings_that_do_not_overlap(imported, pendulum, write_csv):
    text = (
        MAP.partition("[[recording]]")[0]
        + '[[recording]]\npurpose = "train"\nspan = [0.0, 0.7]\n[[recording]]\npurpose ='
        ' "validate"\nspan = [0.7, 1.0]\n'
    )
    outcome = imported(write_csv(pendulum.columns()), map_text=text)
    train, validate = outcome.recording("log_train"), outcome.recording("log_validate")
    assert (train.metadata["purpose"], validate.metadata["purpose"]) == ("train", "validate")
    both = np.concatenate([train.frame["pivot_angle_rad"], validate.frame["pivot_angle_rad"]])
    assert_allclose(both, pendulum.angle)
    assert validate.frame["time_s"].iloc[0] == pytest.approx(7.0, abs=0.006)


def test_where_a_recording_came_from_stands_in_it(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    text = 'rig = "bench"\n' + MAP + "[geometry]\ngravity_m_s2 = 9.81\n"
    metadata = imported(path, map_text=text).recording().metadata
    assert [entry["name"] for entry in metadata["inputs"]] == ["log.csv", "map.toml"]
    assert metadata["config"]["joint"][0]["angle"]["column"] == "angle"
    assert (metadata["rig"], metadata["geometry"]) == ("bench", {"gravity_m_s2": 9.81})
    assert metadata["imported"]["rows_in_source"] == 2000


def test_a_velocity_that_does_not_integrate_to_the_angle_is_reported(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns() | {"velocity": np.degrees(pendulum.velocity)})
    outcome = imported(path)
    assert "integrates to 57.3 times the change of pivot_angle_rad" in outcome.printed


def test_a_torque_of_the_wrong_sign_is_reported(imported, pendulum, write_csv):
    friction = 3.0 * np.tanh(pendulum.velocity / 0.01)
    right = imported(write_csv(pendulum.columns() | {"torque": pendulum.torque + friction}))
    wrong = imported(write_csv(pendulum.columns() | {"torque": -pendulum.torque - friction}))
    assert "check the signs" not in right.printed
    assert "check the signs of angles and torques" in wrong.printed


def test_every_unit_is_what_it_is():
    """A few that stand in everybody's handbook."""
    assert UNITS["rpm"].factor == pytest.approx(0.10471975512)
    assert UNITS["lbf·ft"].factor == pytest.approx(1.3558179483)
    assert UNITS["kgf·cm"].factor == pytest.approx(0.0980665)
    assert UNITS["°F"].factor * 212 + UNITS["°F"].offset == pytest.approx(100.0)
    assert UNITS["K"].factor * 273.15 + UNITS["K"].offset == pytest.approx(0.0)


def test_a_span_has_the_rate_and_the_gaps_of_its_own_part(imported, pendulum, write_csv):
    """The first half at 200 Hz, the second at 100 Hz, as where a logger was set anew."""
    rows = np.r_[0:1000, 1000:2000:2]
    columns = {name: values[rows] for name, values in pendulum.columns().items()}
    text = (
        MAP.partition("[[recording]]")[0]
        + '[[recording]]\npurpose = "train"\nspan_s = [0, 4.99]\n[[recording]]\npurpose ='
        ' "validate"\nspan_s = [5, 99]\n'
    )
    outcome = imported(write_csv(columns), map_text=text)
    rates = [
        outcome.recording(f"log_{name}").metadata["sample_rate_hz"]
        for name in ("train", "validate")
    ]
    assert rates == [pytest.approx(200.0), pytest.approx(100.0)]


def test_where_one_recording_is_refused_none_is_written(imported, pendulum, write_csv):
    text = MAP + '[[recording]]\nname = "late"\npurpose = "validate"\nspan_s = [50, 60]\n'
    outcome = imported(write_csv(pendulum.columns()), map_text=text)
    assert (outcome.code, outcome.folder.exists()) == (2, False)


TURNING = [
    ("deg", 360.0, ""),
    ("rad", 2.0 * np.pi, ""),
    ("counts", 4096.0, ", counts_per_turn = 4096"),
]


@pytest.mark.parametrize(("unit", "turn", "keys"), TURNING, ids=lambda value: str(value)[:6])
def test_a_counter_that_wraps_around_is_reported_with_what_counts_it_on(
    imported, pendulum, write_csv, unit, turn, keys
):
    """An encoder whose zero lies within the swing; the joint itself never turned by more than a
    radian."""
    logged = pendulum.angle * turn / (2.0 * np.pi) % turn
    path = write_csv(
        pendulum.columns() | {"angle": np.floor(logged) if unit == "counts" else logged}
    )
    text = MAP.replace('column = "angle", unit = "rad"', f'column = "angle", unit = "{unit}"{keys}')
    outcome = imported(path, map_text=text)
    assert f"pivot_angle_rad: steps by {turn:.6g} from one row to the next" in outcome.printed
    assert f"kept; set wraps_at = {turn:.10g} at it" in outcome.printed
    outcome = imported(
        path, map_text=text.replace(f'"{unit}"{keys}', f'"{unit}"{keys}, wraps_at = {turn:.17g}')
    )
    assert "kept; set" not in outcome.printed
    assert_allclose(
        np.ptp(outcome.recording().frame["pivot_angle_rad"]), np.ptp(pendulum.angle), atol=0.002
    )


COUNTER = 'unit = "counts", counts_per_turn = 4096, gear_ratio = 50, zero = 1000, wraps_at = 65536'
WITH_A_COUNTER = MAP.replace(
    'column = "angle", unit = "rad"', f'column = "angle", {COUNTER}'
).replace('name = "whole"', 'name = "{file}"')


def motor_counts(angle, zero=1000):
    """What a motor's counter of 16 bits says, 50 motor turns of 4096 counts for one of the
    joint."""
    return (np.round(angle / (2.0 * np.pi) * 50 * 4096).astype(int) + zero) % 65536


@pytest.mark.parametrize("signed", [False, True])
def test_a_counter_begins_in_the_turn_nearest_to_zero_whatever_turn_it_is_logged_in(
    imported, pendulum, write_csv, signed
):
    """Both logs are of one joint; the first begins below zero, where the counter is nearly full."""
    files = []
    for name, shift in (("below", -0.05), ("above", 0.05)):
        columns = pendulum.columns() | {"angle": motor_counts(pendulum.angle + shift)}
        files.append(write_csv(columns, f"{name}.csv"))
    text = (
        WITH_A_COUNTER.replace("wraps_at", "signed_bits = 16, wraps_at")
        if signed
        else WITH_A_COUNTER
    )
    outcome = imported(*files, map_text=text)
    for name, shift in (("below", -0.05), ("above", 0.05)):
        angle = outcome.recording(name).frame["pivot_angle_rad"]
        assert_allclose(angle, pendulum.angle + shift, atol=2e-5)
    assert (
        "begins at 64906 of 65536; taken for -630, in the turn nearest to 1000" in outcome.printed
    ) is not signed
    assert "turn apart" not in outcome.printed


@pytest.mark.parametrize(("lost", "guessed"), [(4, 0), (150, 1)])
def test_a_gap_in_which_a_counter_may_turn_by_half_is_reported(
    imported, pendulum, write_csv, lost, guessed
):
    # At its fastest the joint needs 0.2 s for half of it.
    modulus = 0.4 * np.max(np.abs(pendulum.velocity))
    kept = np.r_[0:700, 700 + lost : len(pendulum.time)]
    columns = pendulum.columns() | {"angle": pendulum.angle % modulus}
    path = write_csv({name: values[kept] for name, values in columns.items()})
    text = MAP.replace('unit = "rad"', f'unit = "rad", wraps_at = {modulus:.9g}', 1)
    outcome = imported(path, map_text=text)
    assert outcome.code == 0, outcome
    assert outcome.printed.count("in 1 gap, the first at 3.495 s; the turn after each") == guessed


def test_logs_that_begin_more_than_half_a_turn_apart_are_reported_and_begins_at_settles_it(
    imported, pendulum, write_csv
):
    """A joint that hangs upright begins half a turn from zero, once to this side of it and once to
    that."""
    files = [
        write_csv(
            pendulum.columns() | {"angle": np.degrees(pendulum.angle + np.pi + shift) % 360.0},
            f"{name}.csv",
        )
        for name, shift in (("a", -0.02), ("b", 0.02))
    ]
    text = MAP.replace(
        'column = "angle", unit = "rad"', 'column = "angle", unit = "deg", wraps_at = 360'
    )
    text = text.replace('name = "whole"', 'name = "{file}"')
    outcome = imported(*files, map_text=text)
    assert "begins at -3.122, in a.csv at 3.122, 1 turn apart; kept" in outcome.printed
    findings = outcome.recording("b").metadata["imported"]["findings"]
    assert any("turn apart" in finding["found"] for finding in findings)
    settled = imported(*files, map_text=text.replace("wraps_at", "begins_at = 180, wraps_at"))
    assert "turn apart" not in settled.printed
    assert_allclose(
        settled.recording("b").frame["pivot_angle_rad"], pendulum.angle + np.pi + 0.02, atol=1e-12
    )


def test_where_a_counter_begins_is_asked_only_of_one_that_wraps_around(
    imported, pendulum, write_csv
):
    text = MAP.replace(
        'column = "angle", unit = "rad"', 'column = "angle", unit = "rad", begins_at = 3.0'
    )
    outcome = imported(write_csv(pendulum.columns()), map_text=text)
    assert (outcome.code, "begins_at: needs wraps_at" in outcome.err) == (2, True)


def test_what_jumps_otherwise_is_no_full_counter(imported, pendulum, write_csv):
    """Neither a spike, nor steps that a motion asks for, nor one that an encoder lost."""
    for jump in (
        np.where(np.arange(2000) == 700, 4.0, 0.0),
        np.where(np.arange(2000) > 700, 2.5, 0.0),
    ):
        path = write_csv(pendulum.columns() | {"angle": pendulum.angle + jump})
        assert "wraps_at" not in imported(path).printed


@pytest.mark.parametrize("on", [[1, 0], [True, False]])
def test_rows_of_a_drive_that_was_off_are_left_out(imported, pendulum, write_csv, on):
    """A current of 0 says nothing of the torque while the bridge is open."""
    columns = pendulum.columns() | {"on": np.repeat(on, 1000)}
    text = MAP.replace('name = "pivot"', 'name = "pivot"\nenabled = "on"')
    outcome = imported(write_csv(columns), map_text=text)
    assert_allclose(
        outcome.recording().frame["pivot_torque_nm"], pendulum.torque[:1000], atol=1e-12
    )
    assert "on is 0 in 1 000 rows: the drive was off" in " ".join(outcome.printed.split())


def test_a_drive_that_was_never_on_and_a_column_that_is_not_there_are_refused(
    imported, pendulum, write_csv
):
    path = write_csv(pendulum.columns() | {"on": np.zeros(2000)})
    never = imported(path, map_text=MAP.replace('name = "pivot"', 'name = "pivot"\nenabled = "on"'))
    assert (never.code, "'on' is on in no row" in never.err) == (2, True)
    absent = imported(
        path, map_text=MAP.replace('name = "pivot"', 'name = "pivot"\nenabled = "onn"')
    )
    assert (absent.code, "has no column 'onn', which joint[0].enabled" in absent.err) == (2, True)


def test_a_switch_in_words_is_refused_and_one_that_is_silent_now_and_then_is_reported(
    imported, pendulum, write_csv
):
    text = MAP.replace('name = "pivot"', 'name = "pivot"\nenabled = "on"')
    words = imported(
        write_csv(pendulum.columns() | {"on": np.repeat(["ON", "OFF"], 1000)}), map_text=text
    )
    assert (words.code, words.err.count("\n")) == (2, 1)
    assert (
        "'on' has no number in any row, expected 0 where the drive was off and another number"
        in words.err
    )
    silent = np.repeat(["1", "0"], 1000).astype(object)
    silent[:20] = ""
    printed = imported(write_csv(pendulum.columns() | {"on": silent}), map_text=text).printed
    assert "on is 0 in 1 000 rows: the drive was off" in printed
    assert "on has no number in 20 rows: the drive's state is not known" in printed


def test_a_set_point_that_begins_later_than_the_log_begins_in_no_turn_before(
    imported, pendulum, write_csv
):
    wrapped = (pendulum.angle + np.pi) % (2 * np.pi) - np.pi
    late = wrapped.astype(object)
    late[:50] = ""
    line = 'velocity = { column = "velocity", unit = "rad/s" }'
    text = MAP.replace(
        line, f'{line}\nreference = {{ column = "asked", unit = "rad", wraps_at = {2 * np.pi} }}'
    )
    outcome = imported(write_csv(pendulum.columns() | {"asked": late}), map_text=text)
    assert (outcome.code, outcome.err) == (0, "")
    assert_allclose(
        outcome.recording().frame["pivot_reference_rad"][50:], pendulum.angle[50:], atol=1e-9
    )
    never = imported(write_csv(pendulum.columns() | {"asked": np.full(2000, "")}), map_text=text)
    assert "Traceback" not in never.err and never.code in (0, 2)


def test_joints_that_make_no_mechanism_are_reported_before_anybody_waits_for_a_fit(
    imported, pendulum, write_csv
):
    columns, text = (
        pendulum.columns(),
        MAP.replace('velocity = { column = "velocity", unit = "rad/s" }\n', ""),
    )
    first = text[text.index("[[joint]]") : text.index("[[recording]]")]
    for name in ("elbow", "wrist"):
        columns |= {f"{name}_angle": pendulum.angle, f"{name}_torque": pendulum.torque}
        own = first.replace('"pivot"', f'"{name}"').replace('column = "', f'column = "{name}_')
        text = text.replace("[[recording]]", own + "[[recording]]")
    outcome = imported(write_csv(columns), map_text=text)
    assert outcome.code == 0, outcome.err
    assert "exoid identify and exoid diagnose do not" in " ".join(outcome.printed.split())
    printed = " ".join(outcome.printed.split())
    assert (
        "elbow (revolute), wrist (revolute) make no known mechanism, which are: two rev" in printed
    )
    assert (
        "`exoid run` stops after filtering: pivot (revolute), elbow (revolute), wrist"
        " (revolute) make" in printed
    )
    assert "does the rest" not in outcome.printed


def test_of_many_logs_each_has_a_line_and_what_was_seen_in_several_is_reported_once(
    imported, pendulum, write_csv
):
    paths = []
    for number in range(4):
        columns = dict(pendulum.columns())
        columns["torque"] = np.where(
            np.arange(len(pendulum.time)) % 100 < number, np.nan, columns["torque"]
        )
        path = write_csv(columns)
        paths.append(path.rename(path.with_name(f"log{number}.csv")))
    several = MAP.replace('name = "whole"', 'name = "{file}"')
    lines = imported(*paths, map_text=several).out.splitlines()
    assert [line.split(":")[1].split(",")[0] for line in lines[:4]] == [" train"] * 4
    assert lines[5] == "Seen, with the numbers of the first file; `exoid show` has those of each:"
    seen = [line for line in lines if "no value in" in line]
    assert seen == ["  - pivot_torque_nm: no value in 20 rows; rows left out (log1.csv and 2 more)"]
    printed = json.loads(imported(*paths, map_text=several, options=("--json",)).out)
    assert [len(one["recordings"][0]["findings"]) > 0 for one in printed] == [
        False,
        True,
        True,
        True,
    ]
    few = imported(*paths[:3], map_text=several).out
    assert few.count("no value in") == 2


def test_an_angle_that_hardly_moves_is_reported(imported, pendulum, write_csv):
    columns = pendulum.columns()
    tiny = columns | {"angle": 1e-9 * columns["angle"], "velocity": 1e-9 * columns["velocity"]}
    assert (
        "rad only, expected 0.001 rad or more to see inertia" in imported(write_csv(tiny)).printed
    )
    assert "to see inertia" not in imported(write_csv(columns, "usual.csv")).printed


def test_commas_between_thousands_are_read_over(imported, pendulum, tmp_path):
    path = tmp_path / "log.csv"
    rows = zip(pendulum.time, pendulum.angle, pendulum.velocity, 1e3 * pendulum.torque, strict=True)
    lines = [f'{t:.3f},{q:.12f},{dq:.12f},"{tau:,.6f}"' for t, q, dq, tau in rows]
    path.write_text("\n".join(["time,angle,velocity,torque", *lines]))
    outcome = imported(path, map_text=MAP.replace('unit = "N·m"', 'unit = "mN·m"'))
    assert_allclose(outcome.recording().frame["pivot_torque_nm"], pendulum.torque, atol=1e-9)
    assert "torque: commas between thousands; read without them" in " ".join(outcome.out.split())


@pytest.mark.parametrize("other", ["---", "ERR", "1234.5", "1234", ""])
def test_what_has_no_comma_does_not_hide_those_between_thousands(
    imported, pendulum, write_csv, other
):
    written = [f"{1e3 * torque:,.6f}" for torque in pendulum.torque]
    assert sum("," in text for text in written) > 300
    written[77] = other
    path = write_csv(pendulum.columns() | {"torque": [f'"{text}"' for text in written]})
    outcome = imported(path, map_text=MAP.replace('unit = "N·m"', 'unit = "mN·m"'))
    assert "torque: commas between thousands; read without them" in outcome.printed
    expected = pendulum.torque.copy()
    expected[77] = float(other) / 1e3 if other[:1].isdigit() else np.nan
    kept = np.isfinite(expected)
    assert_allclose(outcome.recording().frame["pivot_torque_nm"], expected[kept], atol=1e-9)
    assert ("1 row with text" in outcome.printed) is (other in ("---", "ERR"))


def test_where_one_comma_is_between_no_thousands_none_is(imported, pendulum, write_csv):
    written = [f'"{1e3 * torque:,.6f}"' for torque in pendulum.torque]
    written[77] = '"0,5"'
    assert "rows with text" in imported(write_csv(pendulum.columns() | {"torque": written})).printed


def test_a_comma_that_may_be_a_decimal_one_is_not_taken_for_one_between_thousands(
    imported, pendulum, tmp_path
):
    path = tmp_path / "log.csv"
    rows = zip(pendulum.time, pendulum.angle, pendulum.velocity, pendulum.torque, strict=True)
    lines = [
        f'{t:.3f},{q:.12f},{dq:.12f},"{f"{tau:.3f}".replace(".", ",")}"' for t, q, dq, tau in rows
    ]
    path.write_text("\n".join(["time,angle,velocity,torque", *lines]))
    outcome = imported(path)
    assert outcome.code == 2 and "torque" in outcome.err


def test_commas_in_whole_numbers_from_1000_on_alone_are_between_thousands(
    imported, pendulum, write_csv
):
    written = [f'"{round(1e3 * torque):,}"' for torque in pendulum.torque]
    assert 300 < sum("," in text for text in written) < 1900
    outcome = imported(
        write_csv(pendulum.columns() | {"torque": written}),
        map_text=MAP.replace('unit = "N·m"', 'unit = "mN·m"'),
    )
    assert "torque: commas between thousands; read without them" in outcome.printed
    frame = outcome.recording().frame
    assert_allclose(frame["pivot_torque_nm"], np.round(pendulum.torque, 3), atol=1e-9)


@pytest.mark.parametrize("other", ["0,5", "12,3456", "7.5", "1234"])
def test_commas_that_whole_numbers_below_1000_have_too_are_not(
    imported, pendulum, write_csv, other
):
    written = [f'"{round(1e3 * torque):,}"' for torque in pendulum.torque]
    written[77] = f'"{other}"'
    assert "rows with text" in imported(write_csv(pendulum.columns() | {"torque": written})).printed


def test_rows_that_are_missing_do_not_hide_that_a_counter_wraps(imported, pendulum, write_csv):
    columns = pendulum.columns()
    written = columns | {"angle": np.round(6e4 * columns["angle"]).astype(int) % 65536}
    # Half a register's range is travelled meanwhile.
    kept = np.ones(len(pendulum.time), dtype=bool)
    fast = int(np.argmax(np.abs(pendulum.velocity)))
    moved = 6e4 * np.abs(pendulum.angle - pendulum.angle[fast])
    kept[fast + 1 : fast + int(np.argmax(moved[fast:] > 3e4))] = False
    path = write_csv({name: values[kept] for name, values in written.items()})
    counts = MAP.replace('unit = "rad"', 'unit = "counts", counts_per_turn = 376991', 1)
    outcome = imported(path, map_text=counts)
    assert "set wraps_at = 65536" in outcome.printed, outcome


def test_a_torque_without_its_sign_is_named(imported, pendulum, write_csv):
    """As torque meters log it that write the direction in words."""
    words = np.where(pendulum.torque < 0.0, "CCW", "CW")
    columns = pendulum.columns() | {"torque": np.abs(pendulum.torque), "direction": words}
    outcome = imported(write_csv(columns))
    assert outcome.code == 0
    assert "pivot_torque_nm: turns round at 0 as a magnitude does" in outcome.printed
    assert "its sign is missing" not in imported(write_csv(pendulum.columns())).printed


def test_an_angle_without_its_sign_is_named(imported, pendulum, write_csv):
    """As an inclinometer writes the magnitude of a tilt."""
    outcome = imported(write_csv(pendulum.columns() | {"angle": np.abs(pendulum.angle)}))
    assert outcome.code == 0
    assert "pivot_angle_rad: turns round at 0 as a magnitude does" in outcome.printed
    assert "its sign is missing" not in imported(write_csv(pendulum.columns())).printed


@pytest.mark.parametrize("name", ["enc_delta", "d_theta", "pos increment", "sin_theta"])
def test_a_name_that_says_no_angle_is_named(imported, pendulum, write_csv, name):
    columns = pendulum.columns()
    path = write_csv(columns | {name: columns.pop("angle")})
    outcome = imported(path, map_text=MAP.replace('column = "angle"', f'column = "{name}"'))
    assert outcome.code == 0, outcome.err
    assert f"the name of {name!r} says a change from row to row" in outcome.printed


@pytest.mark.parametrize("name", ["angle_D", "position", "theta_1", "cosmo_angle"])
def test_a_name_that_may_be_of_an_angle_is_not(imported, pendulum, write_csv, name):
    columns = pendulum.columns()
    path = write_csv(columns | {name: columns.pop("angle")})
    outcome = imported(path, map_text=MAP.replace('column = "angle"', f'column = "{name}"'))
    assert outcome.code == 0, outcome.err
    assert "read as an angle, as the map says" not in outcome.printed


@pytest.mark.parametrize(
    ("other", "is_named"), [(np.cos, True), (np.ones_like, False), (np.abs, False)]
)
def test_a_sine_next_to_its_cosine_is_named(imported, pendulum, write_csv, other, is_named):
    """As a simulation logs what it observes, obs_0 and obs_1."""
    angle = pendulum.angle
    written = {"obs_0": np.round(other(angle), 6), "angle": np.round(np.sin(angle), 6)}
    outcome = imported(write_csv(pendulum.columns() | written))
    assert outcome.code == 0, outcome.err
    expected = "pivot_angle_rad: 'angle' and 'obs_0' are sine and cosine"
    assert (expected in outcome.printed) == is_named


def test_a_torque_whose_decimal_point_moves_is_named(imported, pendulum, write_csv):
    torque = np.where(np.abs(pendulum.torque) < 0.5, 10.0 * pendulum.torque, pendulum.torque)
    printed = imported(write_csv(pendulum.columns() | {"torque": torque})).printed
    assert "pivot_torque_nm: leaps by a factor of ten, and back" in printed


def test_an_angle_that_leaps_is_named(imported, pendulum, write_csv):
    """As where a drive writes its ring buffer from its first row on, and not from the oldest."""
    columns = pendulum.columns()
    columns = {name: values[:1500] for name, values in columns.items()}
    turned = {name: np.roll(columns[name], 700) for name in columns if name != "time"}
    printed = imported(write_csv(columns | turned)).printed
    assert "pivot_angle_rad: leaps once, first from" in printed
    assert "as no mass can" not in imported(write_csv(columns)).printed


def test_a_torque_of_one_sign_that_only_touches_zero_lacks_none(imported, pendulum, write_csv):
    """As that of a brake, or of a joint that always carries its load to one side."""
    columns = pendulum.columns() | {"torque": 1.0 - np.cos(6.0 * pendulum.time)}
    assert "its sign is missing" not in imported(write_csv(columns)).printed


@pytest.mark.parametrize(
    ("above", "key"),
    [
        ("Factor,1,2,1,0.5\nstate,time,angle,velocity,torque\n", "x,"),
        ("# Scale: 1,2,1,0.5\n# time,angle,velocity,torque\n", ""),
        ("key,time,angle,velocity,torque\nGain [-],1,2,1,0.5\nOffset,0,0,0,0\n", ","),
    ],
)
def test_factors_above_the_rows_are_named_until_the_map_has_a_scale(
    imported, guessed, pendulum, write_csv, above, key
):
    path = write_csv(pendulum.columns(), header=False)
    rows = path.read_text().splitlines()
    path.write_text(above + "".join(f"{key}{row}\n" for row in rows))
    outcome = imported(path)
    assert outcome.code == 0
    assert len(outcome.recording().frame) == 2000
    assert " 2 of 'angle'; taken to be in the values" in outcome.printed
    assert " 0.5 of 'torque'" in outcome.printed
    assert "'velocity'" not in outcome.printed and "Offset" not in outcome.printed
    scaled = MAP.replace('"rad" }', '"rad", scale = 2.0 }').replace('m" }', 'm", scale = 1.0 }')
    assert "the file says" not in imported(path, map_text=scaled).printed
    _, doubts = guessed(path)
    assert "the file says" in doubts["joint"]


@pytest.mark.parametrize("name", ["node", "Serial No.", "axis_id", "Gerät"])
def test_rows_of_several_machines_are_named(imported, pendulum, write_csv, name):
    """Their clocks go on together, as those of two drives on one bus."""
    labels = np.where(np.arange(2000) // 500 % 2, "B7", "A3")
    outcome = imported(write_csv(pendulum.columns() | {name: labels}))
    assert outcome.code == 0
    assert f"'{name}' is A3 in 1 000 rows, B7 in 1 000 rows; all kept as one" in outcome.printed
    outcome = imported(write_csv(pendulum.columns() | {name: labels[:1].repeat(2000)}))
    assert "kept as one" not in outcome.printed


def test_rows_whose_values_are_no_measurements_are_named(imported, pendulum, write_csv):
    """A historian repeats the last value while the connection is lost."""
    labels = np.where(np.arange(2000) % 500 < 20, "Bad", "Good")
    outcome = imported(write_csv(pendulum.columns() | {"Angle.Quality": labels}))
    assert outcome.code == 0
    assert "'Angle.Quality' is Good in 1 920 rows, Bad in 80 rows; all kept" in outcome.printed


def test_dates_in_a_column_that_is_named_as_a_label_are_no_labels(imported, pendulum, tmp_path):
    path = tmp_path / "log.parquet"
    dates = pd.date_range("2026-01-31", periods=2, freq="D").repeat(1000)
    pd.DataFrame(pendulum.columns() | {"valid_from": dates}).to_parquet(path)
    outcome = imported(path)
    assert outcome.code == 0, outcome.err
    assert "valid_from" not in outcome.printed


@pytest.mark.parametrize("name", ["joint_speed", "axis_temperature", "motor", "leg_id_rms"])
def test_a_quantity_of_a_machine_is_no_label_of_its_rows(imported, pendulum, write_csv, name):
    outcome = imported(write_csv(pendulum.columns() | {name: np.arange(2000) % 3}))
    assert f"'{name}'" not in outcome.printed


@pytest.mark.parametrize(
    ("first", "second", "later"),
    [
        (slice(0, None, 2), slice(1, None, 2), "0.5 of a row apart"),
        (slice(0, 1000), slice(0, 1000), "0.0 of a row apart"),
        (slice(0, 1000), slice(40, 1040), ""),
    ],
    ids=["two samples a row", "one column twice", "another motion"],
)
def test_joints_that_are_one_are_named(imported, pendulum, write_csv, first, second, later):
    """A logger that sends packets writes several samples in a row, angle0 and angle1."""
    columns = {"time": pendulum.time[first]}
    text = MAP.split("[[joint]]")[0]
    for k, rows in enumerate((first, second)):
        noise = 1e-4 * np.random.default_rng(k).normal(size=1000)
        columns |= {f"angle{k}": pendulum.angle[rows] + noise, f"torque{k}": pendulum.torque[rows]}
        text += (
            f'[[joint]]\nname = "joint{k}"\nangle = {{ column = "angle{k}", unit = "rad" }}\n'
            f'torque = {{ column = "torque{k}", unit = "N·m" }}\n'
        )
    text += '[[recording]]\nname = "whole"\npurpose = "train"\n'
    outcome = imported(write_csv(columns), map_text=text)
    assert outcome.code == 0
    expected = "joint1_angle_rad: is joint0_angle_rad, "
    assert (expected in outcome.printed) == bool(later)
    assert later in outcome.printed


@pytest.mark.parametrize(
    ("written", "keys", "expected"),
    [
        ("torque [mNm]", 'unit = "N·m"', "the file says mN·m of 'torque [mNm]', the map N·m"),
        ("torque_Nmm", 'unit = "N·m"', "the file says mN·m"),
        ("torque_daNm", 'unit = "N·m"', "the file says daNm of 'torque_daNm', the map N·m"),
        ("torque [N.mm/kg]", 'unit = "N.mm"', "the file says N.mm/kg"),
        ("torque ozf-in", 'unit = "N·m"', "the file says ozf-in"),
        ("torque_Nm_per_kg", 'unit = "N·m"', "the file says Nm_per_kg"),
        ("torque Nm/kg", 'unit = "N·m"', "the file says Nm/kg"),
        ("torque_Nm_kg", 'unit = "N·m"', "the file says Nm_kg"),
        ("torque_gf", 'unit = "N·m"', ""),
        ("torque [0.1 Nm]", 'unit = "N·m"', "the file says 0.1 Nm"),
        ("torque [A]", 'unit = "N·m"', "the file says A of"),
        ("torque [N m]", 'unit = "N·m"', ""),
        ("torque (N*mm)", 'unit = "mN·m"', ""),
        ("torque [mNm]", 'unit = "N·m", scale = 1.0', ""),
        ("torque m", 'unit = "N·m"', ""),
    ],
)
def test_a_unit_in_a_name_that_is_not_that_of_the_map_is_named(
    imported, pendulum, write_csv, written, keys, expected
):
    columns = pendulum.columns()
    path = write_csv(columns | {written: columns.pop("torque")})
    text = MAP.replace('column = "torque", unit = "N·m"', f'column = "{written}", {keys}')
    assert written in text
    outcome = imported(path, map_text=text)
    assert outcome.code == 0, outcome.err
    assert ("the file says" in outcome.printed) == bool(expected)
    assert expected in outcome.printed


@pytest.mark.parametrize(
    ("written", "keys", "expected"),
    [
        ("Time (ms)", 'unit = "s"', "the file says ms of 'Time (ms)', the map s"),
        ("t_min", 'unit = "s"', "the file says min of 't_min'"),
        ("Elapsed (h)", 'unit = "s"', "the file says h of"),
        ("Gait cycle (%)", 'unit = "s"', "the file says % of"),
        ("tick_100us", 'unit = "s"', "the file says 100us of"),
        ("Time (ms)", 'unit = "s", scale = 1.0', ""),
        ("Time [sec]", 'unit = "s"', ""),
        ("motor_A", 'unit = "s"', ""),
    ],
)
def test_a_unit_in_the_name_of_a_clock_that_is_not_that_of_the_map_is_named(
    imported, pendulum, write_csv, written, keys, expected
):
    columns = pendulum.columns()
    path = write_csv({written: columns.pop("time")} | columns)
    keys = keys.replace(", ", "\n")
    text = MAP.replace('column = "time"\nunit = "s"', f'column = "{written}"\n{keys}')
    assert written in text
    outcome = imported(path, map_text=text)
    assert outcome.code == 0, outcome.err
    assert ("the file says" in outcome.printed) == bool(expected)
    assert expected in outcome.printed


@pytest.mark.parametrize("places", [2, 4])
def test_minutes_that_are_read_as_decimals_of_a_degree_are_named(
    imported, pendulum, write_csv, places
):
    """As a theodolite or a rotary table writes 12° 59' 30": 12.5930."""
    text = MAP.replace('column = "angle", unit = "rad"', 'column = "angle", unit = "deg"')
    true = 40.0 * np.sin(3.0 * pendulum.time)
    size = np.floor(3600.0 * np.abs(true))
    written = size // 3600 + size % 3600 // 60 / 100 + size % 60 / 10000
    for degrees, is_named in ((true, False), (np.round(2.0 * true) / 2.0, False), (written, True)):
        kept = np.floor(10**places * np.abs(degrees) + 1e-6) / 10**places
        path = write_csv(pendulum.columns() | {"angle": np.copysign(kept, true)})
        outcome = imported(path, map_text=text)
        assert outcome.code == 0, outcome.err
        assert ("decimals never reach .60" in outcome.printed) == is_named


def test_an_outlier_above_all_integers_is_no_minute():
    assert not have_minutes(np.array([1.0, 2.0, 1e30, np.nan]))


def test_a_torque_that_is_cut_off_is_named(imported, pendulum, write_csv):
    columns = pendulum.columns()
    assert "at full slope" not in imported(write_csv(columns)).printed
    columns["torque"] = np.clip(columns["torque"], -0.9, 1.1)
    expected = "pivot_torque_nm: comes to -0.9 and 1.1 at full slope and stays there"
    assert expected in imported(write_csv(columns)).printed
