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
    assert (
        "run1_torque.csv: has no column 'time', the clock by which files are joined" in outcome.err
    )


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
