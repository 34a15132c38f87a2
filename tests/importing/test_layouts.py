"""The layout of a file is read, whatever the tool that wrote it."""

import json

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose

from pipelines.errors import InputError
from pipelines.importing.quantities.numbers import numbers
from pipelines.importing.sources.open import open_source
from pipelines.settings.import_map import SourceSettings
from tests.importing.conftest import MAP

NAMES = ("time", "angle", "velocity", "torque")


@pytest.fixture(scope="module")
def table():
    """A hundred rows of a swing, as texts with five decimals."""
    time = np.arange(100) / 100.0
    angle, velocity = np.sin(4.0 * time), 4.0 * np.cos(4.0 * time)
    values = np.column_stack([time, angle, velocity, 0.3 * velocity - angle])
    return [[f"{value:.5f}" for value in row] for row in values]


@pytest.fixture
def read(tmp_path):
    """Write lines to a file and return its columns as numbers."""

    def call(lines, name="log.csv", encoding="utf-8", **settings):
        path = tmp_path / name
        path.write_bytes("\n".join([*lines, ""]).encode(encoding))
        source = open_source(path, SourceSettings(**settings))
        columns = source.load(source.names)
        return source, {name: numbers(values) for name, values in columns.items()}

    return call


def assert_same(columns, table, names=NAMES):
    truth = np.array(table, dtype=float).T
    for name, values in zip(names, truth, strict=True):
        assert_allclose(columns[name], values, atol=1e-12)


def joined(rows, delimiter=",", tail="", decimal="."):
    return [delimiter.join(field.replace(".", decimal) for field in row) + tail for row in rows]


@pytest.mark.parametrize(
    ("above", "delimiter", "tail"),
    [
        (["Gain,1.0,1.0,1.0", "time,angle,velocity,torque"], ",", ""),
        (["Samples,100", "100,4", "# time,angle,velocity,torque"], ",", ""),
        (["// rate, 100, Hz", "// time, angle, velocity, torque"], ",", ""),
        (["time,angle,velocity,torque"], ",", ","),
        (["time,angle,velocity,torque,"], ",", ""),
        (["time,angle,velocity,torque,,"], ",", ",,"),
        (["time,angle,velocity,torque,Comment"], ",", ""),
        (["nRows=100", "nColumns=4", "endheader", "time\tangle\tvelocity\ttorque"], "\t", ""),
        (['"time";"angle";"velocity";"torque"'], ";", ""),
        (["   time  angle   velocity  torque"], " ", ""),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else repr(value),
)
def test_data_begin_where_rows_of_numbers_go_on_and_names_are_above(
    read, table, above, delimiter, tail
):
    _, columns = read([*above, *joined(table, delimiter, tail)])
    assert_same(columns, table)


def test_row_numbers_without_a_name_are_a_column_of_their_own_and_said(read, table):
    """As R writes a table: a header one name short of the rows."""
    rows = [[f'"{k}"', *row] for k, row in enumerate(table, 1)]
    source, columns = read(['"time" "angle" "velocity" "torque"', *joined(rows, " ")])
    assert_same(columns, table)
    assert source.remarks == ("row numbers have no name; called row",)


def test_a_header_that_fits_no_rows_is_named_with_the_column_that_is_missing(
    imported, table, tmp_path
):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,angle", *joined(table)]))
    outcome = imported(path)
    assert outcome.code == 2
    assert (
        "the header 'time, angle' has 2 names, the rows 4 fields: name them in source.columns"
        in outcome.err
    )


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_any_encoding_of_an_editor_is_read(read, table, encoding):
    _, columns = read(["at 20 °C", ";".join(NAMES), *joined(table, ";")], encoding=encoding)
    assert_same(columns, table)


@pytest.mark.parametrize("cell", ["ERR", "#DIV/0!", "1,#QNAN0"])
def test_a_text_among_decimal_commas_costs_its_row_only(read, table, cell):
    rows = joined(table, ";", decimal=",")
    rows[50] = ";".join([*rows[50].split(";")[:3], cell])
    _, columns = read([";".join(NAMES), *rows, "EOF"])
    assert np.flatnonzero(np.isnan(columns["torque"])).tolist() == [50, 100]
    assert_same({name: values[:50] for name, values in columns.items()}, table[:50])


@pytest.mark.parametrize(("decimal", "mark"), [(",", "."), (".", ",")])
def test_marks_between_thousands_are_no_decimal_points(read, table, decimal, mark):
    torques = [f"{2e6 + 1e6 * k:,.2f}" for k in range(len(table))]
    swapped = str.maketrans({",": mark, ".": decimal})
    rows = [
        ";".join([*(field.translate(swapped) for field in row[:3]), torque.translate(swapped)])
        for row, torque in zip(table, torques, strict=True)
    ]
    _, columns = read([";".join(NAMES), *rows])
    assert_allclose(columns["torque"], 2e6 + 1e6 * np.arange(len(table)))
    assert_allclose(columns["angle"], np.array(table, dtype=float)[:, 1])


def test_three_decimals_after_a_comma_are_no_thousands(read):
    rows = [f"{k},{k:03d};{k + 1},250;{k + 2},125" for k in range(1, 60)]
    _, columns = read(["time;angle;torque", *rows])
    assert columns["torque"][0] == 3.125


def test_a_header_that_comes_again_is_no_second_table(read, table):
    head = ",".join(NAMES)
    _, columns = read([head, *joined(table[:50]), head, *joined(table[50:])])
    kept = {name: values[np.isfinite(values)] for name, values in columns.items()}
    assert_same(kept, table)


@pytest.mark.parametrize("rows", [100, 3000], ids=["near", "far"])
@pytest.mark.parametrize("second", ["t2,x,y,z", "t2,x"])
def test_a_second_table_in_a_file_is_refused(read, table, rows, second):
    first = joined(table * (rows // 100))
    below = [row.split(",")[: second.count(",") + 1] for row in joined(table)]
    with pytest.raises(InputError, match="save each as a file of its own"):
        read([",".join(NAMES), *first, "", second, *joined(below)])


def test_words_in_place_of_a_row_are_no_second_table(read, table):
    rows = joined(table)
    _, columns = read([",".join(NAMES), *rows[:50], "motor stopped, by hand", *rows[50:]])
    kept = {name: values[np.isfinite(columns["time"])] for name, values in columns.items()}
    assert_same(kept, table)


def test_pairs_of_x_and_y_have_the_names_above_them_and_clocks_of_their_own(read, table):
    pairs = [[row[0], row[1], row[0], row[3]] for row in table]
    source, columns = read(["Position,,Current mA,", "X,Y,X,Y", *joined(pairs)])
    assert_allclose(columns["Position [Y]"], np.array(table, dtype=float)[:, 1])
    assert source.clocks == {
        "Position [Y]": "Position [X]",
        "Current mA [Y]": "Current mA [X]",
    }


def test_names_in_two_lines_are_put_together(read, table):
    _, columns = read(["clock,hip,knee,knee", "t,pos,pos,tau", "s,rad,rad,Nm", *joined(table)])
    names = ["clock [t] [s]", "hip pos [rad]", "knee pos [rad]", "knee tau [Nm]"]
    assert_same(columns, table, names)


@pytest.mark.parametrize("units", ["s,rad,rad/s,Nm", "[s],[rad],[rad/s],[Nm]", "s,rad,,Nm"])
def test_a_line_of_descriptions_below_names_and_units_hides_neither(read, table, units):
    below = 'of the logger,of the joint,"estimate, filtered",at the joint'
    _, columns = read(["t,phi,dphi,tau", units, below, *joined(table)])
    velocity = "dphi [rad/s]" if "rad/s" in units else "dphi"
    assert_same(columns, table, ["t [s]", "phi [rad]", velocity, "tau [Nm]"])


def test_an_export_of_twincat_scope_names_its_columns_and_clocks(read, table):
    """Facts about each channel, whose key stands at every clock; a clock may serve several."""
    facts = {"Name": NAMES[1:], "SampleTime[ms]": "1" * 3, "Unit": ("rad", "(None)", "Nm")}
    rows = [[row[0], row[1], row[2], row[0], row[3]] for row in table]
    lines = [
        "Name\tleg",
        "File\tC:\\leg.csv",
        "",
        *("\t".join([key, of[0], of[1], key, of[2]]) for key, of in facts.items()),
        "",
        *joined(rows, "\t", decimal=","),
        "EOF",
    ]
    source, columns = read(lines)
    assert_allclose(columns["torque"][:-1], np.array(table, dtype=float)[:, 3])
    clock, other = "time of angle [ms]", "time of torque [ms]"
    assert source.clocks == {"angle": clock, "velocity": clock, "torque": other}
    assert source.units == {"angle": "rad", "torque": "Nm"}


def test_labview_lvm_is_read_with_each_channels_clock(read, table):
    lines = [
        "LabVIEW Measurement\t",
        "Separator\tTab",
        "***End_of_Header***\t",
        "",
        "Channels\t2\t\t\t",
        "Samples\t100\t\t100\t",
        "Y_Unit_Label\trad\t\tNm\t",
        "Delta_X\t0.01\t\t0.01\t",
        "***End_of_Header***\t\t\t\t",
        "X_Value\tangle\tX_Value\ttorque\tComment",
        *joined([[row[0], row[1], row[0], row[3]] for row in table], "\t"),
    ]
    source, columns = read(lines, "log.lvm")
    assert_allclose(columns["torque"], np.array(table, dtype=float)[:, 3])
    assert source.clocks["torque"] == "X_Value#2"


def lvm(segments, decimal=".", x_columns="No"):
    """A file of LabVIEW, of segments as (samples, date and time, X0, Delta_X, names, rows)."""

    def written(value):
        return str(value).replace(".", decimal)

    yield from ("LabVIEW Measurement\t", "Separator\tTab", f"Decimal_Separator\t{decimal}")
    yield from (f"X_Columns\t{x_columns}", "***End_of_Header***\t", "\t")
    for samples, (date, time), starts, steps, names, rows in segments:
        count = len(names)
        tags = {"Samples": [samples] * count, "Date": [date] * count, "Time": [time] * count}
        tags |= {"Y_Unit_Label": ["rad", "Nm"], "X0": starts, "Delta_X": steps}
        yield f"Channels\t{count}\t"
        for tag, values in tags.items():
            yield "\t".join([tag, *map(written, values)]) + "\t"
        yield "***End_of_Header***\t\t\t"
        yield from ("***Start_Special***", "Notes\t1\t2", "***End_Special***")
        yield "\t".join(["X_Value", *names, "Comment"])
        yield from (f"\t{written(one)}\t{written(other)}" for one, other in rows)
        yield ""


DAY = ("2026/01/31", "12:00:00.1234567890123")


@pytest.mark.parametrize("decimal", [".", ","])
def test_labview_lvm_without_a_column_of_times_has_those_of_its_header(read, table, decimal):
    """Segments go on by their X0, or else by their date and time."""
    rows = [(row[1], row[3]) for row in table]
    later = ("2026/01/31", "12:00:00.6234567890123")
    step, names = ["0.01"] * 2, ("angle", "torque")
    one = [(100, DAY, ["0.5", "0.5"], step, names, rows)]
    by_x0 = [
        (50, DAY, ["0.5"] * 2, step, names, rows[:50]),
        (50, DAY, ["1.0"] * 2, step, names, rows[50:]),
    ]
    by_date = [
        (50, DAY, ["0.5"] * 2, step, names, rows[:50]),
        (50, later, ["0.5"] * 2, step, names, rows[50:]),
    ]
    for segments in (one, by_x0, by_date):
        source, columns = read(list(lvm(segments, decimal)), "log.lvm")
        assert list(columns) == ["X_Value", "angle", "torque"]
        assert_allclose(columns["X_Value"], 0.5 + np.arange(100) / 100.0, atol=1e-6)
        assert_allclose(columns["torque"], np.array(rows, dtype=float)[:, 1], atol=1e-12)
        assert source.units == {"X_Value": "s", "angle": "rad", "torque": "Nm"}


def test_labview_lvm_whose_channels_have_different_steps_has_a_clock_for_each(read, table):
    rows = [(row[1], table[k][3] if k < 50 else "") for k, row in enumerate(table)]
    segment = (100, DAY, ["0.0", "0.0"], ["0.01", "0.02"], ("angle", "torque"), rows)
    source, columns = read(list(lvm([segment])), "log.lvm")
    assert source.clocks == {"angle": "X_Value#1", "torque": "X_Value#2"}
    known = np.isfinite(columns["torque"])
    assert_allclose(columns["X_Value#2"][known], np.arange(50) / 50.0, atol=1e-12)


def test_labview_lvm_whose_rows_were_written_one_by_one_has_no_clock(read, table):
    rows = [(row[1], row[3]) for row in table]
    names = ("angle", "torque")
    source, columns = read(list(lvm([(1, DAY, [0, 0], [1, 1], names, rows)])), "log.lvm")
    assert "X_Value" not in columns and "set time.rate_hz" in source.remarks[0]
    source, columns = read(list(lvm([(50, DAY, [0, 0], [0.01] * 2, names, rows)])), "log.lvm")
    assert "100 rows under a header for 50" in source.remarks[0]
    assert_allclose(columns["X_Value"], np.arange(100) / 100.0, atol=1e-12)


def test_segments_of_labview_lvm_with_a_column_of_times_follow_each_other(read, table):
    """The times of a segment start over, and count from its own date."""
    rows = [(row[1], row[3]) for row in table]
    later = ("2026/01/31", "12:00:01.1234567890123")
    segments = [(100, day, [0, 0], [0.01] * 2, ("angle", "torque"), rows) for day in (DAY, later)]
    times = [row[0] for row in table] * 2
    lines = list(lvm(segments, x_columns="One"))
    inside = [k for k, line in enumerate(lines) if line.startswith("\t") and line.strip()]
    for k, time in zip(inside, times, strict=True):
        lines[k] = time + lines[k]
    _, columns = read(lines, "log.lvm")
    assert_allclose(columns["X_Value"], np.arange(200) / 100.0, atol=1e-6)


def test_segments_of_labview_lvm_with_other_columns_are_refused(read, table):
    rows = [(row[1], row[3]) for row in table]
    segments = [(100, DAY, [0, 0], [0.01] * 2, names, rows) for names in (("q", "tau"), ("q", "i"))]
    with pytest.raises(InputError, match="segments with different columns"):
        read(list(lvm(segments)), "log.lvm")


def test_a_json_log_whose_last_line_is_cut_loses_that_line(read):
    lines = [f'{{"t": {k}, "q": {k * k}}}' for k in range(20)]
    source, columns = read([*lines, '{"t": 20, "q"'], "log.json")
    assert_allclose(columns["q"], np.arange(20) ** 2)
    assert "is cut; left out" in source.remarks[0]


def two(values):
    return np.vstack([values, 0.5 * values])


def test_time_lies_along_the_axis_that_is_as_long_as_the_clock(imported, pendulum, tmp_path):
    """The same of MATLAB, NumPy, JSON and HDF5, which share how arrays become columns."""
    log = {
        "time": pendulum.time[np.newaxis],
        "q": np.vstack([pendulum.angle, pendulum.velocity]),
        "tau": two(pendulum.torque)[:, np.newaxis],
    }
    scipy.io.savemat(tmp_path / "log.mat", {"run": log})
    text = MAP.replace('"time"', '"run.time"').replace('"angle"', '"run.q[0]"')
    text = text.replace('"velocity"', '"run.q[1]"').replace('"torque"', '"run.tau[0]"')
    frame = imported(tmp_path / "log.mat", map_text=text).recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque)
    np.savez(tmp_path / "log.npz", **log)
    source = open_source(tmp_path / "log.npz", SourceSettings())
    assert source.names == ("time", "q[0]", "q[1]", "tau[0]", "tau[1]")
    assert_allclose(source.load(["tau[1]"])["tau[1]"], 0.5 * pendulum.torque)


def test_channels_in_rows_of_hdf5_are_columns(pendulum, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["leg/time"], file["leg/q"] = pendulum.time, two(pendulum.angle)
    source = open_source(tmp_path / "log.h5", SourceSettings())
    assert source.names == ("leg/q[0]", "leg/q[1]", "leg/time")
    assert_allclose(source.load(["leg/q[1]"])["leg/q[1]"], 0.5 * pendulum.angle)


def structs(fields, rows):
    array = np.zeros((1, len(rows)), dtype=[(field, object) for field in fields])
    for k, row in enumerate(rows):
        array[0, k] = row
    return array


def test_an_array_of_structs_is_signals_by_their_names(pendulum, tmp_path):
    """As Simulink's Structure With Time, dSPACE's ControlDesk, and a Dataset saved as a struct."""
    time, signals = (
        pendulum.time[:, np.newaxis],
        [("angle", pendulum.angle), ("tau", pendulum.torque)],
    )
    columns = {name: values[:, np.newaxis] for name, values in signals}
    rows = [(values, 1.0, name) for name, values in columns.items()]
    elements = [
        (name, {"Time": time, "Data": values.reshape(1, 1, -1)}) for name, values in columns.items()
    ]
    log = {
        "out": {"time": time, "signals": structs(["values", "dimensions", "label"], rows)},
        "exp": {"Y": structs(["Name", "Data"], [(name, v.T) for name, v in columns.items()])},
        "logsout": {"Elements": structs(["Name", "Values"], elements)},
    }
    scipy.io.savemat(tmp_path / "log.mat", log)
    source = open_source(tmp_path / "log.mat", SourceSettings())
    names = ["out.signals.tau", "exp.Y.tau", "logsout.Elements.tau.Values.Data"]
    for name in names:
        assert_allclose(source.load([name])[name], pendulum.torque)
    assert source.clocks[names[2]] == "logsout.Elements.tau.Values.Time"


def test_a_signal_of_an_array_of_structs_may_be_named_by_its_place(imported, pendulum, tmp_path):
    """``exp.Y.Data[0]`` is the first signal, as in MATLAB's ``exp.Y(1).Data``."""
    signals = [(name, values[np.newaxis]) for name, values in pendulum.columns().items()]
    scipy.io.savemat(tmp_path / "log.mat", {"exp": {"Y": structs(["Name", "Data"], signals)}})
    text = MAP
    for place, name in enumerate(pendulum.columns()):
        text = text.replace(f'"{name}"', f'"exp.Y.Data[{place}]"')
    frame = imported(tmp_path / "log.mat", map_text=text).recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque)
    twice = imported(tmp_path / "log.mat", map_text=text.replace("Data[3]", "angle"))
    assert twice.code == 2 and "exp.Y.Data[1], exp.Y.angle in the map are one" in twice.err


def test_joints_of_a_record_keep_their_names_when_their_order_changes(read):
    def joints(k):
        both = [{"name": "hip", "pos": k, "eff": 2 * k}, {"name": "knee", "pos": -k, "eff": 0}]
        return both[::-1] if k % 7 == 3 else both

    lines = [json.dumps({"t": k / 100, "joints": joints(k)}) for k in range(100)]
    _, columns = read(lines, "log.jsonl")
    assert_allclose(columns["joints.hip.pos"], np.arange(100))
    assert_allclose(columns["joints.hip.eff"], 2 * np.arange(100))
    assert_allclose(columns["joints.knee.pos"], -np.arange(100))


def test_lists_next_to_names_in_changing_order_are_read_by_the_names(read):
    def record(k):
        turned = -1 if k % 7 == 0 else 1
        return {"t": k / 100, "name": ["hip", "knee"][::turned], "q": [k, -k][::turned]}

    _, columns = read([json.dumps(record(k)) for k in range(100)], "log.jsonl")
    assert_allclose(columns["q.hip"], np.arange(100))
    assert_allclose(columns["q.knee"], -np.arange(100))


def test_a_date_and_one_number_are_a_row(read):
    """As in a file of one quantity, one of several of a run."""
    rows = [f"2026-01-31 12:00:{k:02}.5;{0.5 * k}" for k in range(60)]
    source, columns = read(["started;2026-01-31", "stamp;torque", *rows])
    assert source.names == ("stamp", "torque")
    assert_allclose(columns["torque"], 0.5 * np.arange(60))


def fixed_width(table, is_blank):
    """Return lines in columns of 12 characters; some rows have no angle."""
    return ["".join(f"{name:>12}" for name in NAMES)] + [
        f"{row[0]:>12}{'' if is_blank(n) else row[1]:>12}{row[2]:>12}{row[3]:>12}"
        for n, row in enumerate(table)
    ]


def test_a_blank_between_spaces_never_moves_the_next_column_into_its_place(read, table):
    _, columns = read(fixed_width(table, lambda n: n % 7 == 3), "log.txt")
    short = np.arange(len(table)) % 7 == 3
    truth = np.array(table, dtype=float).T
    assert_allclose(columns["time"], truth[0])
    for name, values in zip(NAMES[1:], truth[1:], strict=True):
        assert_allclose(columns[name], np.where(short, np.nan, values))


def test_blanks_in_most_rows_between_spaces_are_refused(read, table):
    with pytest.raises(InputError, match="more than the 3 fields"):
        read(fixed_width(table, lambda n: n % 7 != 3), "log.txt")


def test_a_last_column_of_words_may_be_blank_between_spaces(read, table):
    lines = [" ".join([*row, *["event"] * (n % 3 < 2)]) for n, row in enumerate(table)]
    _, columns = read([" ".join([*NAMES, "state"]), *lines], "log.txt")
    assert_same(columns, table)


def test_names_with_units_apart_are_not_given_to_the_columns_of_others(read, table):
    header = "time (s) angle (rad) velocity (rad/s) torque (Nm)"
    source, _ = read([header, *joined(table, " ")], "log.txt")
    assert source.names == ("c1", "c2", "c3", "c4")
    assert "has 8 names, the rows 4 fields" in source.remarks[0]


def test_a_unit_that_is_a_product_makes_a_line_one_of_units(imported, pendulum, tmp_path):
    """Motion capture writes quantity, axis and unit in three lines, and moments for each kg."""
    lines = [
        "Model Outputs",
        "200",
        ",,A:KneeAngles,,A:KneeMoment,",
        "Frame,Sub Frame,X,Y,X,Y",
        ",,deg,deg,N.mm/kg,N.mm/kg",
    ]
    values = zip(np.degrees(pendulum.angle), 10.0 * pendulum.torque, strict=True)
    lines += [f"{k},0,{angle},1.5,{moment},2.5" for k, (angle, moment) in enumerate(values, 1)]
    path = tmp_path / "model.csv"
    path.write_text("\n".join(lines) + "\n")
    outcome = imported(
        path,
        map_text="""
[time]
rate_hz = 200.0
[[joint]]
name = "pivot"
angle = { column = "A:KneeAngles [X] [deg]", unit = "deg" }
torque = { column = "A:KneeMoment [X] [N.mm/kg]", unit = "N.mm" }
[[recording]]
name = "whole"
purpose = "train"
""",
    )
    assert outcome.code == 0, outcome.err
    assert np.allclose(outcome.recording().frame["pivot_angle_rad"], pendulum.angle)
    assert "the file says N.mm/kg" in outcome.printed


@pytest.mark.parametrize(
    ("unit", "keys", "is_named"),
    [
        ("FT-LBS", "", True),
        ("N-M", "", False),
        ("FT-LBS", ", scale = 1.0", False),
    ],
)
def test_units_above_columns_that_the_map_names_are_compared(
    imported, pendulum, tmp_path, unit, keys, is_named
):
    """A dynamometer writes names with spaces between spaces, so that the map names the columns."""
    lines = ["  mSec   TORQUE   POS (ANAT)   SPEED", f"  {unit}  DEGREES  DEG/SEC"]
    columns = (1e3 * pendulum.time, pendulum.torque, np.degrees(pendulum.angle))
    rows = zip(*columns, np.degrees(pendulum.velocity), strict=True)
    lines += ["  ".join(f"{value:.4f}" for value in row) for row in rows]
    path = tmp_path / "dynamometer.txt"
    path.write_text("\n".join(lines) + "\n")
    outcome = imported(
        path,
        map_text=f"""
[source]
columns = ["t", "tau", "q", "dq"]
[time]
column = "t"
unit = "ms"
[[joint]]
name = "pivot"
angle = {{ column = "q", unit = "deg" }}
velocity = {{ column = "dq", unit = "deg/s" }}
torque = {{ column = "tau", unit = "N·m"{keys} }}
[[recording]]
name = "whole"
purpose = "train"
""",
    )
    assert outcome.code == 0, outcome.err
    assert ("say lbf·ft, the map N·m" in outcome.printed) == is_named
    assert outcome.printed.count("the lines above") == is_named


@pytest.mark.parametrize(
    ("scope", "keys", "is_named"),
    [
        ("above", "", True),
        ("above", ", scale = 1.0", False),
        ("beside", "", True),
        ("beside", ", scale = 1.0", False),
    ],
)
def test_volts_of_an_oscilloscope_are_compared(imported, pendulum, tmp_path, scope, keys, is_named):
    """One writes its settings above the rows, another to the left of the first of them."""
    rows = list(zip(pendulum.time, pendulum.angle, pendulum.torque, strict=True))
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    if scope == "above":
        above = ("Model,MSO44", "Horizontal Units,s", "Vertical Units,V,V", "Label,a,b")
        lines = [*above, "TIME,CH1,CH2", *lines]
        names = ("TIME", "CH1", "CH2")
    else:
        beside = ["Record Length,2500,", "Vertical Units,V,", "Vertical Scale,2.0,V"]
        beside += ["Horizontal Units,s,", "Pt Fmt,Y,"]
        left = [*beside, *[",,"] * (len(lines) - len(beside))]
        lines = [f"{a},{b}" for a, b in zip(left, lines, strict=True)]
        names = ("c4", "c5", "c6")
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(lines) + "\n")
    outcome = imported(
        path,
        map_text=f"""
[time]
column = "{names[0]}"
unit = "s"
[[joint]]
name = "pivot"
angle = {{ column = "{names[1]}", unit = "rad"{keys} }}
torque = {{ column = "{names[2]}", unit = "N·m"{keys} }}
[[recording]]
name = "whole"
purpose = "train"
""",
    )
    assert outcome.code == 0, outcome.err
    assert outcome.printed.count("the file says V of") == 2 * is_named
