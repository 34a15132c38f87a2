"""Formats of vendors are read through their libraries, each channel by its own clock."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.importing.sources.excel import tens_shown
from tests.importing.conftest import MAP
from tests.importing.test_formats import BAG_MAP, assert_is_the_pendulum


@pytest.mark.parametrize("has_time", [True, False], ids=["a channel of times", "waveforms"])
def test_tdms(imported, pendulum, tmp_path, has_time):
    nptdms = pytest.importorskip("nptdms")
    properties = {} if has_time else {"wf_increment": 0.005, "wf_start_offset": 0.0}
    names = (
        ["time", *("angle", "velocity", "torque")] if has_time else ["angle", "velocity", "torque"]
    )
    channels = [
        nptdms.ChannelObject("run", name, getattr(pendulum, name), properties) for name in names
    ]
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment(channels)
    text = MAP
    for name in ("time", "angle", "velocity", "torque"):
        text = text.replace(f'column = "{name}"', f'column = "run/{name}"')
    assert_is_the_pendulum(imported(tmp_path / "log.tdms", map_text=text), pendulum)


@pytest.mark.parametrize("sheets", [1, 2])
def test_excel_with_titles_units_and_a_text_in_a_column(imported, pendulum, tmp_path, sheets):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for sheet in [book.active, *(book.create_sheet() for _ in range(sheets - 1))]:
        sheet.append(["A pendulum", None, 3])
        sheet.append([])
        sheet.append(["time", "angle", "velocity", "torque"])
        sheet.append(["s", "rad", "rad/s", "Nm"])
        for row in list(zip(*pendulum.columns().values(), strict=True))[:300]:
            sheet.append([float(value) for value in row])
        sheet["D104"] = "ERR"
    book.save(tmp_path / "log.xlsx")
    text = MAP
    for name, unit in (("time", "s"), ("angle", "rad"), ("velocity", "rad/s"), ("torque", "Nm")):
        text = text.replace(f'column = "{name}"', f'column = "{name} [{unit}]"')
    outcome = imported(tmp_path / "log.xlsx", map_text=text)
    if sheets == 2:
        assert outcome.code == 2
        assert "has tables in Sheet, Sheet1; name one in the map: source.table" in outcome.err
        return
    frame = outcome.recording().frame
    assert len(frame) == 299 and "with text, the first 'ERR' in row 99" in outcome.printed
    assert_allclose(frame["pivot_torque_nm"], np.delete(pendulum.torque[:300], 99), atol=1e-12)


@pytest.mark.parametrize(("number_format", "stored"), [("0.0%", 0.01), ('0.0"%"', 1.0)])
def test_a_share_of_a_workbook_is_read_in_the_per_cent_that_it_is_shown_in(
    imported, pendulum, tmp_path, number_format, stored
):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["time", "angle", "velocity", "torque [%]"])
    for *others, torque in list(zip(*pendulum.columns().values(), strict=True))[:300]:
        # 20 N·m are 100 %.
        book.active.append([*map(float, others), stored * 5.0 * float(torque)])
        book.active.cell(book.active.max_row, 4).number_format = number_format
    book.save(tmp_path / "log.xlsx")
    share = 'torque = { column = "torque [%]", unit = "%", rated_torque_nm = 20.0 }'
    text = MAP.replace('torque = { column = "torque", unit = "N·m" }', share)
    assert share in text
    frame = imported(tmp_path / "log.xlsx", map_text=text).recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[:300], atol=1e-12)


@pytest.mark.parametrize(
    ("number_format", "tens"),
    [
        ("General", 0),
        ("#,##0.00", 0),
        ("#,##0", 0),
        ("0.000,", -3),
        ("#,##0,", -3),
        ("0,.00", -3),
        ("0.0,,", -6),
        ('0.0,"k"', -3),
        ('0.0" Nm, raw"', 0),
        ("0.0%", 2),
        ("[Red]0.0,;-0.0,", -3),
    ],
)
def test_a_comma_behind_the_last_digit_divides_by_a_thousand(number_format, tens):
    assert tens_shown(number_format) == tens


def test_cells_that_are_shown_in_thousands_are_read_as_shown(imported, pendulum, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["time", "angle", "velocity", "torque"])
    for *others, torque in list(zip(*pendulum.columns().values(), strict=True))[:300]:
        book.active.append([*map(float, others), 1e3 * float(torque)])
        book.active.cell(book.active.max_row, 4).number_format = "0.000,"
    book.save(tmp_path / "log.xlsx")
    frame = imported(tmp_path / "log.xlsx").recording().frame
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[:300], atol=1e-12)


@pytest.mark.parametrize("name", ["log.xlsx", "log.npz"])
def test_a_workbook_or_archive_that_was_cut_is_said_to_be_damaged(
    imported, pendulum, tmp_path, name
):
    np.savez(tmp_path / "log.npz", **pendulum.columns())
    cut = (tmp_path / "log.npz").read_bytes()[:3000]
    (tmp_path / name).write_bytes(cut)
    outcome = imported(tmp_path / name)
    assert outcome.code == 2 and "damaged or truncated" in outcome.err
    assert "copy it again" in outcome.err


def test_channels_of_asam_mdf_keep_the_clock_of_their_group(imported, pendulum, tmp_path):
    asammdf = pytest.importorskip("asammdf")
    file, slower = asammdf.MDF(), slice(None, None, 2)
    file.append(
        [asammdf.Signal(pendulum.angle, pendulum.time, name="angle", unit="rad")],
        common_timebase=True,
    )
    file.append([asammdf.Signal(pendulum.torque[slower], pendulum.time[slower], name="torque")])
    file.save(tmp_path / "log.mf4")
    text = MAP.replace('column = "time"', 'column = "time#2"')
    text = text.replace('velocity = { column = "velocity", unit = "rad/s" }\n', "")
    outcome = imported(tmp_path / "log.mf4", map_text=text)
    # The map names no clock for the angle: the file says that it is time#1.
    assert "sampled at 200 Hz by a clock of its own (time#1)" in outcome.printed
    frame = outcome.recording().frame
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle[slower], atol=1e-12)
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[slower], atol=1e-12)


def test_ros_1_bags(imported, pendulum, tmp_path):
    rosbag1, typesys = (
        pytest.importorskip("rosbags.rosbag1"),
        pytest.importorskip("rosbags.typesys"),
    )
    store, kind = typesys.get_typestore(typesys.Stores.ROS1_NOETIC), "sensor_msgs/msg/JointState"
    types = store.types
    with rosbag1.Writer(tmp_path / "log.bag") as writer:
        states = writer.add_connection("/joint_states", kind, typestore=store)
        for k, (time, *values) in enumerate(zip(*pendulum.columns().values(), strict=True)):
            stamp = 1_700_000_000_000_000_000 + round(time * 1e9)
            at = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
            header = types["std_msgs/msg/Header"](k, at, "base")
            message = types[kind](header, ["pivot"], *(np.array([value]) for value in values))
            writer.write(states, stamp, store.serialize_ros1(message, kind))
    assert_is_the_pendulum(imported(tmp_path / "log.bag", map_text=BAG_MAP), pendulum)


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("log.tdms", b"TDSm" + b"x" * 200, "is a damaged .tdms file"),
        ("log.mf4", b"MDF     4.10    " + b"x" * 200, "is a damaged MDF file"),
        ("log.npy", b"\x93NUMPY" + b"x" * 200, "cannot be read as arrays of numbers"),
        ("log.bag", b"#ROSBAG V2.0\n" + b"x" * 200, "is no ROS bag that can be read"),
    ],
)
def test_a_damaged_file_ends_in_one_line(imported, tmp_path, name, content, line):
    (tmp_path / name).write_bytes(content)
    outcome = imported(tmp_path / name)
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert line in outcome.err
