"""A log says the same whatever format it is written in."""

import json
import sys
import tomllib

import numpy as np
import pandas as pd
import pytest
import scipy.io
from numpy.testing import assert_allclose

from exoid_cli.app import run
from pipelines.importing.finding import noting
from pipelines.importing.quantities.numbers import numbers
from pipelines.importing.sources.dialect import _encoding
from tests.importing.conftest import MAP


def assert_is_the_pendulum(outcome, pendulum, name="whole"):
    assert (outcome.code, outcome.err) == (0, "")
    frame = outcome.recording(name).frame
    assert_allclose(frame["time_s"], pendulum.time, atol=1e-9)
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle, atol=1e-12)
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-12)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"delimiter": ";", "decimal": ","},
        {"delimiter": "\t"},
        {"delimiter": "|"},
        {"delimiter": " "},
        {"encoding": "utf-8-sig"},
        {"encoding": "utf-16"},
        {"before": "# recorded by hand\n# at 20 °C\n"},
        {"before": "Logger 3\nDate;2025-01-31\n\n", "delimiter": ";"},
        {"name": "log.txt"},
    ],
    ids=str,
)
def test_text_is_read_however_it_is_delimited(imported, pendulum, write_csv, how):
    assert_is_the_pendulum(imported(write_csv(pendulum.columns(), **how)), pendulum)


@pytest.mark.parametrize("padding", range(4))
def test_a_character_of_two_bytes_near_the_end_of_a_file_does_not_change_its_encoding(padding):
    assert _encoding(b"time,angle\n" + b"x" * padding + "20 °C,\n".encode()) == "utf-8"
    assert _encoding("20 °C,\n".encode()[:4]) == "utf-8"
    assert _encoding("20 °C,\n".encode("cp1252")) == "cp1252"


def test_comments_among_the_rows_are_no_rows(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    lines = path.read_text().splitlines()
    lines.insert(500, "# the operator coughed, twice, loudly, here")
    path.write_text("\n".join(lines))
    assert_is_the_pendulum(imported(path), pendulum)


@pytest.mark.parametrize("mark", ["#", "!", "*"])
def test_a_mark_of_the_maps_own_is_no_row_and_may_hold_the_header(
    imported, pendulum, write_csv, mark
):
    path = write_csv(pendulum.columns())
    header, rest = path.read_text().split("\n", 1)
    # More numbers than a row of data has names: only the mark tells that they are none.
    path.write_text(f"{mark} 1, 2, 3, 4\n{mark} 5, 6, 7, 8\n{mark} {header}\n{rest}")
    text = f'[source]\ncomment = "{mark}"\n{MAP}'
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)


@pytest.mark.parametrize("units", ["[s],[rad],[rad/s],[Nm]", "sec,radians,rad/sec,Nm"])
def test_a_row_of_units_below_the_header_belongs_to_the_names(imported, pendulum, write_csv, units):
    path = write_csv(pendulum.columns())
    header, rest = path.read_text().split("\n", 1)
    path.write_text(f"{header}\n{units}\n{rest}")
    names = dict(
        zip(pendulum.columns(), units.replace("[", "").replace("]", "").split(","), strict=True)
    )
    text = MAP
    for name, unit in names.items():
        text = text.replace(f'column = "{name}"', f'column = "{name} [{unit}]"')
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)


def test_columns_without_a_header_can_be_named_or_numbered(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns(), header=False)
    named = '[source]\ncolumns = ["time", "angle", "velocity", "torque"]\n' + MAP
    assert_is_the_pendulum(imported(path, map_text=named), pendulum)
    numbered = MAP
    for k, name in enumerate(pendulum.columns(), 1):
        numbered = numbered.replace(f'column = "{name}"', f'column = "c{k}"')
    assert_is_the_pendulum(imported(path, map_text=numbered), pendulum)


def test_names_in_quotes_may_hold_the_delimiter(imported, pendulum, write_csv):
    columns = {f'"{name}, measured"': values for name, values in pendulum.columns().items()}
    text = MAP
    for name in pendulum.columns():
        text = text.replace(f'column = "{name}"', f'column = "{name}, measured"')
    assert_is_the_pendulum(imported(write_csv(columns), map_text=text), pendulum)


def test_dates_are_time(imported, pendulum, write_csv):
    dates = pd.Timestamp("2025-03-30 01:59:58.000123") + pd.to_timedelta(pendulum.time, unit="s")
    path = write_csv(pendulum.columns() | {"time": dates.strftime("%Y-%m-%d %H:%M:%S.%f")})
    assert_is_the_pendulum(
        imported(path, map_text=MAP.replace('unit = "s"', 'unit = "iso8601"')), pendulum
    )


def test_nanoseconds_since_1970_lose_no_digit(imported, pendulum, write_csv):
    stamps = 1_700_000_000_123_456_789 + np.round(pendulum.time * 1e9).astype(np.int64)
    path = write_csv(pendulum.columns() | {"time": stamps})
    assert_is_the_pendulum(
        imported(path, map_text=MAP.replace('unit = "s"', 'unit = "ns"')), pendulum
    )


def test_parquet(imported, pendulum, tmp_path):
    path = tmp_path / "log.parquet"
    pd.DataFrame(pendulum.columns()).to_parquet(path)
    assert_is_the_pendulum(imported(path), pendulum)


def test_parquet_with_nested_columns(imported, pendulum, tmp_path):
    path = tmp_path / "log.parquet"
    states = [
        {"angle": a, "velocity": v} for a, v in zip(pendulum.angle, pendulum.velocity, strict=True)
    ]
    pd.DataFrame({"time": pendulum.time, "state": states, "torque": pendulum.torque}).to_parquet(
        path
    )
    text = MAP.replace('"angle"', '"state.angle"').replace('"velocity"', '"state.velocity"')
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)


@pytest.mark.parametrize("shape", ["records", "under a key", "columns", "lines"])
def test_json(imported, pendulum, tmp_path, shape):
    columns = {name: values.tolist() for name, values in pendulum.columns().items()}
    records = pd.DataFrame(columns).to_dict("records")
    text = {
        "records": json.dumps(records),
        "under a key": json.dumps({"mass": 0.5, "motor": "m", "entries": records}),
        "columns": json.dumps({"mass": 0.5, **columns}),
        "lines": "\n".join(json.dumps(record) for record in records),
    }[shape]
    path = tmp_path / "log.json"
    path.write_text(text)
    assert_is_the_pendulum(imported(path), pendulum)


def test_json_with_arrays_in_its_records(imported, pendulum, tmp_path):
    records = [
        {"t": t, "joints": {"q": [0.0, q], "dq": [0.0, dq]}, "tau": [0.0, tau]}
        for t, q, dq, tau in zip(
            *(values.tolist() for values in pendulum.columns().values()), strict=True
        )
    ]
    path = tmp_path / "log.json"
    path.write_text(json.dumps({"data": {"samples": records}, "note": "x"}))
    text = '[source]\ntable = "data.samples"\n' + MAP.replace('"time"', '"t"').replace(
        '"angle"', '"joints.q[1]"'
    )
    text = text.replace('"velocity"', '"joints.dq[1]"').replace('"torque"', '"tau[1]"')
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)


@pytest.mark.parametrize("version", ["4", "5"])
def test_matlab(imported, pendulum, tmp_path, version):
    path = tmp_path / "log.mat"
    columns = {name: values[:, np.newaxis] for name, values in pendulum.columns().items()}
    scipy.io.savemat(path, columns, format=version)
    assert_is_the_pendulum(imported(path), pendulum)


def test_matlab_structs_and_matrices(imported, pendulum, tmp_path):
    path = tmp_path / "log.mat"
    state = np.column_stack([pendulum.angle, pendulum.velocity])
    scipy.io.savemat(
        path, {"run": {"time": pendulum.time, "state": state, "drive": {"torque": pendulum.torque}}}
    )
    text = MAP.replace('"time"', '"run.time"').replace('"angle"', '"run.state[0]"')
    text = text.replace('"velocity"', '"run.state[1]"').replace('"torque"', '"run.drive.torque"')
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)


def test_matlab_v73(imported, pendulum, tmp_path):
    """As MATLAB writes it: HDF5 behind a header of 512 bytes, axes the other way round, a class at
    each variable."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in pendulum.columns().items():
            file[name] = values[np.newaxis, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["title"] = np.array([[104, 105]], dtype=np.uint16)
        file["title"].attrs["MATLAB_class"] = np.bytes_("char")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    assert_is_the_pendulum(imported(path), pendulum)


def test_hdf5(imported, pendulum, tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["run/time"] = pendulum.time
        file["run/state"] = np.column_stack([pendulum.angle, pendulum.velocity])
        file["run/drive"] = np.array([(t,) for t in pendulum.torque], dtype=[("torque", float)])
    text = MAP.replace('"time"', '"run/time"').replace('"angle"', '"run/state[0]"')
    text = text.replace('"velocity"', '"run/state[1]"').replace('"torque"', '"run/drive.torque"')
    assert_is_the_pendulum(imported(path, map_text=text), pendulum)
    below = text.replace("run/", "")
    assert_is_the_pendulum(imported(path, map_text='[source]\ntable = "run"\n' + below), pendulum)


def test_packed_numbers_of_netcdf_are_unpacked_by_their_attributes(imported, pendulum, tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.nc"
    with h5py.File(path, "w") as file:
        for name, values in pendulum.columns().items():
            file[name] = values
        del file["torque"]
        packed = np.round((pendulum.torque - 2.0) / 2e-4).astype(np.int16)
        packed[5] = -32768
        file["torque"] = packed
        attributes = {"scale_factor": 2e-4, "add_offset": 2.0, "_FillValue": np.int16(-32768)}
        file["torque"].attrs.update(attributes)
    outcome = imported(path)
    assert outcome.code == 0
    assert "torque: unpacked by scale_factor and add_offset of the file" in outcome.printed
    torque = outcome.recording().frame["pivot_torque_nm"]
    assert_allclose(torque, np.delete(pendulum.torque, 5), atol=1e-4)


BAG_MAP = """
[time]
column = "stamp"
unit = "ns"

[[joint]]
name = "pivot"
angle = { column = "pivot.position", unit = "rad" }
velocity = { column = "pivot.velocity", unit = "rad/s" }
torque = { column = "pivot.effort", unit = "N·m" }

[[recording]]
name = "whole"
purpose = "train"
"""


def test_ros_bags(imported, pendulum, bag):
    assert_is_the_pendulum(imported(bag, map_text=BAG_MAP), pendulum)
    (stored,) = (file for file in bag.iterdir() if file.suffix in (".mcap", ".db3"))
    assert_is_the_pendulum(imported(stored, map_text=BAG_MAP), pendulum)


def test_a_library_that_is_not_installed_is_named_with_its_extra(
    imported, pendulum, tmp_path, monkeypatch
):
    path = tmp_path / "log.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    monkeypatch.setitem(sys.modules, "h5py", None)
    outcome = imported(path)
    assert outcome.code == 2
    assert (
        outcome.err == f"exoid: {path}: needs h5py, which is not installed; pip install"
        " 'exoid[import]'\n"
    )


@pytest.mark.parametrize("row", [50, 1900])
def test_a_line_of_nul_bytes_costs_its_row_wherever_it_stands(imported, pendulum, write_csv, row):
    """As a logger leaves them whose disk was full; the first is among the bytes by which the format
    is found."""
    path = write_csv(pendulum.columns())
    lines = path.read_bytes().split(b"\n")
    lines[row + 1] = b"\0" * len(lines[row + 1])
    path.write_bytes(b"\n".join(lines))
    outcome = imported(path)
    assert (outcome.code, len(outcome.recording().frame)) == (0, 1999)
    assert r"time: 1 row with text, the first '\x00" in outcome.printed
    assert f"in row {row}; taken for missing" in outcome.printed


def as_parquet(pendulum, tmp_path, time):
    path = tmp_path / "log.parquet"
    pd.DataFrame(pendulum.columns() | {"time": time}).to_parquet(path)
    return path


@pytest.mark.parametrize("zone", [None, "Europe/Rome"])
@pytest.mark.parametrize("unit", ["iso8601", "ns"])
def test_dates_and_durations_of_parquet_are_time(imported, pendulum, tmp_path, zone, unit):
    since = pd.to_timedelta(pendulum.time, unit="s")
    dates = pd.Timestamp("2025-03-30 01:59:58.000123", tz=zone) + since
    map_text = MAP.replace('unit = "s"', f'unit = "{unit}"')
    assert_is_the_pendulum(
        imported(as_parquet(pendulum, tmp_path, dates), map_text=map_text), pendulum
    )
    if unit == "ns":
        assert_is_the_pendulum(
            imported(as_parquet(pendulum, tmp_path, since), map_text=map_text), pendulum
        )


@pytest.mark.parametrize("form", ["parquet", "csv"])
@pytest.mark.parametrize("unit", ["s", "ms", "us"])
def test_dates_whose_unit_is_one_of_numbers_are_refused_with_the_right_one(
    imported, pendulum, tmp_path, write_csv, form, unit
):
    dates = pd.Timestamp("2025-03-30 01:59:58.000123") + pd.to_timedelta(pendulum.time, unit="s")
    if form == "csv":
        path = write_csv(pendulum.columns() | {"time": dates.strftime("%Y-%m-%dT%H:%M:%S.%f")})
    else:
        path = as_parquet(pendulum, tmp_path, dates)
    outcome = imported(path, map_text=MAP.replace('unit = "s"', f'unit = "{unit}"'))
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert "'time' holds dates, the first '2025-03-30T01:59:58.000123" in outcome.err
    assert f"but the map has time.unit = '{unit}'; set it to iso8601" in outcome.err


def test_durations_whose_unit_is_another_are_refused_with_the_right_one(
    imported, pendulum, tmp_path
):
    outcome = imported(as_parquet(pendulum, tmp_path, pd.to_timedelta(pendulum.time, unit="s")))
    assert outcome.code == 2 and "'time' holds durations, the first" in outcome.err
    assert outcome.err.endswith("set it to ns\n")


@pytest.mark.parametrize(("unit", "factor"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_numbers_whose_unit_is_that_of_dates_are_refused_with_the_unit_of_a_usual_rate(
    imported, pendulum, write_csv, unit, factor
):
    path = write_csv(pendulum.columns() | {"time": factor * pendulum.time})
    outcome = imported(path, map_text=MAP.replace('unit = "s"', 'unit = "iso8601"'))
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    content = "'time' holds plain numbers, the first '0.0'"
    assert f"{content}, but the map has time.unit = 'iso8601'" in outcome.err
    assert outcome.err.endswith(f"set it to {unit}\n")


def test_dates_where_an_angle_should_be_are_no_numbers(imported, pendulum, tmp_path):
    path = tmp_path / "log.parquet"
    dates = pd.Timestamp("2025-03-30") + pd.to_timedelta(pendulum.time, unit="s")
    pd.DataFrame(pendulum.columns() | {"angle": dates}).to_parquet(path)
    outcome = imported(path)
    assert outcome.code == 2 and "with text, the first '2025-03-30" in outcome.err


def test_a_date_that_is_missing_is_no_text():
    findings = []
    values = np.array(["2025-03-30", "NaT", "NaT"], dtype="datetime64[ns]")
    assert np.isnan(numbers(values, noting("angle", findings))).all()
    assert [finding.observation for finding in findings] == [
        "1 row with text, the first '2025-03-30T00:00:00.' in row 0"
    ]


def test_a_guess_takes_dates_of_parquet_for_dates(imported, pendulum, tmp_path, capsys):
    dates = pd.Timestamp("2025-03-30 01:59:58.000123") + pd.to_timedelta(pendulum.time, unit="s")
    path = as_parquet(pendulum, tmp_path, dates)
    assert run(["import", str(path), "--guess"]) == 0
    text = capsys.readouterr().out
    assert tomllib.loads(text)["time"] == {"column": "time", "unit": "iso8601"}
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(np.diff(frame["time_s"]), 0.005, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "coarse"),
    [("time_s", False), ("t [ms]", False), ("x", False), ("time_s", True), ("t [ms]", True)],
)
def test_a_guess_takes_durations_of_parquet_for_ns_whatever_their_name_says(
    imported, pendulum, tmp_path, capsys, name, coarse
):
    since = pd.to_timedelta(pendulum.time, unit="s").round("us")
    path = tmp_path / "log.parquet"
    pd.DataFrame(
        {name: since.floor("10ms") if coarse else since} | pendulum.columns() | {"time": 0.0}
    ).to_parquet(path)
    assert run(["import", str(path), "--guess"]) == 0
    text = capsys.readouterr().out
    assert tomllib.loads(text)["time"] == (
        {"rate_hz": 200.0} if coarse else {"column": name, "unit": "ns"}
    )
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


def test_records_of_hdf5_may_have_text_and_records_of_several_joints(imported, pendulum, tmp_path):
    """Samples along the first axis, each with a state in words and a part for each joint."""
    h5py = pytest.importorskip("h5py")
    part = [("pos", "f8"), ("trq", "f4")]
    records = np.zeros(len(pendulum.time), [("t", "f8"), ("axis", part, (2,)), ("mode", "S8")])
    records["t"], records["mode"] = pendulum.time, b"OP"
    records["axis"]["pos"][:, 1] = pendulum.angle
    records["axis"]["trq"][:, 1] = pendulum.torque
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["run/samples"] = records
    map_text = MAP.replace('"time"', '"run/samples.t"', 1)
    map_text = map_text.replace('"angle"', '"run/samples.axis.pos[1]"')
    map_text = map_text.replace('"torque"', '"run/samples.axis.trq[1]"')
    map_text = "\n".join(line for line in map_text.splitlines() if "velocity" not in line)
    frame = imported(path, map_text=map_text).recording().frame
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle, atol=1e-9)
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque, atol=1e-5)


def test_an_archive_of_numpy_is_read_without_its_python_objects(imported, pendulum, tmp_path):
    """They could run a program; a table of settings next to the signals is no reason to refuse."""
    path, objects = tmp_path / "log.npz", np.array([{"robot": "arm"}], dtype=object)
    np.savez(path, **pendulum.columns(), settings=objects)
    outcome = imported(path)
    assert_allclose(outcome.recording().frame["pivot_angle_rad"], pendulum.angle)
    np.savez(path, log=objects)
    outcome = imported(path)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "holds Python objects in log" in outcome.err
