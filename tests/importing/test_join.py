"""A run in several files is one recording, by the clocks of its files."""

import tomllib

import numpy as np
from numpy.testing import assert_allclose

from exoid_cli.app import run
from tests.importing.conftest import MAP

PARTS = ("angle", "velocity", "torque")


def write_parts(write_csv, pendulum, run_name, rows=slice(None)):
    """Write a file for each quantity; the torque has the given rows of its own."""
    paths = []
    for part in PARTS:
        some = rows if part == "torque" else slice(None)
        columns = {"time": pendulum.time[some], part: getattr(pendulum, part)[some]}
        paths.append(write_csv(columns, name=f"{run_name}_{part}.csv"))
    return paths


def joined_map(*names):
    return f"[source]\njoin = {list(names)}\n".replace("'", '"') + MAP


def test_files_with_equal_clocks_are_joined_row_by_row(imported, pendulum, write_csv):
    paths = write_parts(write_csv, pendulum, "run1")
    outcome = imported(*paths, map_text=joined_map(*(path.name for path in paths)))
    frame = outcome.recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-12)
    assert "joined with run1_velocity.csv, run1_torque.csv by the clock 'time'" in outcome.printed
    assert "interpolated" not in outcome.printed


def test_files_with_other_clocks_are_interpolated_and_said(imported, pendulum, write_csv):
    paths = write_parts(write_csv, pendulum, "run1", slice(1, None, 4))
    names = ["run1_torque.csv", "run1_angle.csv", "run1_velocity.csv"]
    outcome = imported(paths[0], map_text=joined_map(*names))
    frame = outcome.recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[1::4], atol=1e-12)
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle[1::4], atol=1e-12)
    assert "sampled at 200 Hz by a clock of its own (time#2)" in outcome.printed


def test_a_star_stands_for_the_run_and_a_missing_part_is_named(imported, pendulum, write_csv):
    write_parts(write_csv, pendulum, "a")
    one, *_, last = write_parts(write_csv, pendulum, "b")
    text = joined_map(*(f"*_{part}.csv" for part in PARTS))
    text = text.replace('name = "whole"', 'name = "{file}"')
    outcome = imported(one.with_name("a_torque.csv"), one, map_text=text)
    assert len(outcome.recording("a_angle").frame) == len(outcome.recording("b_angle").frame)
    last.unlink()
    outcome = imported(one, map_text=text)
    assert outcome.code == 2 and "b_torque.csv: no such file" in outcome.err
    other = write_csv({"time": pendulum.time}, name="notes.txt")
    outcome = imported(other, map_text=text)
    assert outcome.code == 2 and "notes.txt: is none of the files *_angle.csv" in outcome.err


def test_a_file_without_the_clock_is_refused(imported, pendulum, write_csv):
    paths = write_parts(write_csv, pendulum, "run1")
    write_csv({"t": pendulum.time, "torque": pendulum.torque}, name="run1_torque.csv")
    outcome = imported(paths[0], map_text=joined_map(*(path.name for path in paths)))
    assert outcome.code == 2
    refusal = "run1_torque.csv: has no column 'time', the clock by which files are joined"
    assert refusal in outcome.err and "set that as time of its channels" in outcome.err
    write_csv({"t": pendulum.time, "angle": pendulum.angle}, name="run1_angle.csv")
    outcome = imported(paths[0], map_text=joined_map(*(path.name for path in paths)))
    assert outcome.err.count("run1_angle.csv:") == 1


def dates_of(pendulum):
    """The pendulum's times as durations (n,), to be added to a date."""
    return np.round(1e6 * pendulum.time).astype("m8[us]")


def with_clock(clock):
    """The map whose velocity has a clock of another name, and whose torque is in its file."""
    of_velocity = 'velocity = { column = "velocity", unit = "rad/s"'
    return joined_map("run1_angle.csv", "run1_rest.csv").replace(
        of_velocity, f"{of_velocity}, {clock}"
    )


def test_files_whose_clocks_have_other_names_and_units_are_joined(imported, pendulum, write_csv):
    """What the map says of the clock at one channel holds for all channels of its file."""
    some = slice(None, None, 2)
    angle = write_csv(
        {"time": pendulum.time[some], "angle": pendulum.angle[some]}, "run1_angle.csv"
    )
    rest = {"t_ms": 1e3 * (pendulum.time + 2.0)}
    rest |= {"velocity": pendulum.velocity, "torque": pendulum.torque}
    write_csv(rest, "run1_rest.csv")
    text = with_clock('time = "t_ms", time_unit = "ms", time_offset_s = -2.0')
    outcome = imported(angle, map_text=text)
    assert_allclose(outcome.recording().frame["pivot_torque_nm"], pendulum.torque[some], atol=1e-9)
    assert "joined with run1_rest.csv by the clocks 'time', 't_ms'" in outcome.printed


def test_dates_in_one_file_and_a_number_in_the_other_need_the_offset(imported, pendulum, write_csv):
    dates = np.datetime64("2026-01-31T12:00:00", "us") + np.round(1e6 * pendulum.time).astype(
        "m8[us]"
    )
    write_csv(
        {"t": dates, "velocity": pendulum.velocity, "torque": pendulum.torque}, "run1_rest.csv"
    )
    angle = write_csv({"time": pendulum.time, "angle": pendulum.angle}, "run1_angle.csv")
    refused = imported(angle, map_text=with_clock('time = "t"'))
    assert refused.code == 2
    assert "joint[0].torque.time_unit = 's'; set it to iso8601" in refused.err
    refused = imported(angle, map_text=with_clock('time = "t", time_unit = "iso8601"'))
    assert refused.code == 2
    assert "dates and plain numbers have no common origin" in refused.err
    assert "time_offset_s (-1769860800 if both began together)" in " ".join(refused.err.split())
    clock = 'time = "t", time_unit = "iso8601", time_offset_s = -1769860800'
    frame = imported(angle, map_text=with_clock(clock)).recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-6)


def test_a_guess_joins_files_of_one_run(imported, pendulum, write_csv, capsys):
    paths = [path for name in ("a", "b") for path in write_parts(write_csv, pendulum, name)]
    assert run(["import", *map(str, paths), "--guess"]) == 0
    text = capsys.readouterr().out
    # The torque's clock first: of all quantities it is least fit to be interpolated.
    assert tomllib.loads(text)["source"]["join"] == [
        "*_torque.csv",
        "*_angle.csv",
        "*_velocity.csv",
    ]
    outcome = imported(*paths, map_text=text)
    frame = outcome.recording("b_torque").frame
    assert_allclose(frame["joint_angle_rad"], pendulum.angle, atol=1e-12)
    assert np.ptp(frame["joint_torque_nm"]) > 0.0


def test_a_guess_takes_the_slowest_clock(pendulum, write_csv, capsys):
    """Between the rows of a faster clock, straight lines would make the angle rough."""
    torque = write_csv({"time": pendulum.time, "torque": pendulum.torque}, name="run1_torque.csv")
    slow = slice(None, None, 3)
    columns = {"time": pendulum.time[slow], "angle": pendulum.angle[slow]}
    angle = write_csv(columns, name="run1_angle.csv")
    assert run(["import", str(torque), str(angle), "--guess"]) == 0
    guess = tomllib.loads(capsys.readouterr().out)
    assert guess["source"]["join"] == ["run1_angle.csv", "run1_torque.csv"]
    assert guess["time"]["column"] == "time"
    assert guess["joint"][0]["torque"]["time"] == "time#2"


def test_a_guess_joins_files_whose_clocks_have_other_names_and_units(
    imported, pendulum, write_csv, capsys
):
    """Dates in one and a number in the other are taken to begin together."""
    dates = np.datetime64("2026-01-31T12:00:00", "us") + dates_of(pendulum)
    in_ms = {"t_ms": 1e3 * pendulum.time}
    for clock, keys in (
        ({"stamp": dates}, {"time_unit": "iso8601", "time_offset_s": -1769860800.0}),
        (in_ms, {"time_unit": "ms"}),
    ):
        torque = write_csv(clock | {"torque": pendulum.torque}, name="run1_torque.csv")
        slow = {"time": pendulum.time[::3], "angle": pendulum.angle[::3]}
        angle = write_csv(slow, name="run1_angle.csv")
        assert run(["import", str(torque), str(angle), "--guess"]) == 0
        text = capsys.readouterr().out
        (joint,) = tomllib.loads(text)["joint"]
        assert {key: joint["torque"].get(key) for key in keys} == keys
        frame = imported(torque, map_text=text).recording("run1_angle_train").frame
        rows = slice(None, 3 * len(frame), 3)
        assert_allclose(frame["joint_torque_nm"], pendulum.torque[rows], atol=1e-6)


def test_a_guess_does_not_join_files_of_two_machines(pendulum, write_csv, capsys):
    one = write_csv({"time": pendulum.time, "angle": pendulum.angle, "torque": pendulum.torque})
    other = {"t": pendulum.time, "pos": pendulum.angle, "current": pendulum.torque}
    assert run(["import", str(one), str(write_csv(other, "other.csv")), "--guess"]) == 2
    assert "guess its own map" in capsys.readouterr().err
