"""What cannot be imported is refused in one line that says where, what and what to do; nothing half
is left."""

import os
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from exoid_cli.app import run
from pipelines.contracts import RECORDING
from pipelines.settings.transmission import gain
from tests.importing.conftest import MAP

BAD_MAPS = [
    (
        'column = "angle"',
        'column = "angel"',
        "has no column 'angel', which joint[0].angle in",
        "did you mean angle?",
    ),
    (
        'unit = "rad"',
        'unit = "rpm"',
        "angle.unit: found 'rpm', a unit of angular velocity, expected one of angle: rad",
    ),
    (
        'unit = "N·m"',
        'unit = "mA"',
        "torque.unit: needs torque_constant_nm_a; add it from the data sheet",
    ),
    (
        'name = "pivot"',
        'name = "pivot"\nkind = "prismatic"',
        (
            "angle.unit: needs lead_m; add it from the data sheet, or "
            'unit = "m", if the log is in metres'
        ),
    ),
    ('unit = "rad"', 'unit = "counts"', "angle.unit: needs counts_per_turn"),
    (
        'unit = "N·m"',
        'unit = "N·m", gain_nm_v = 2.0',
        "torque.unit: does not need gain_nm_v; remove it",
    ),
    (
        'unit = "N·m"',
        'unit = "N·n"',
        "torque.unit: found 'N·n', expected one of torque: N·m",
        "did you mean N·m?",
    ),
    (
        'unit = "rad/s"',
        'unit = "rads"',
        "velocity.unit: found 'rads', expected one of",
        "did you mean rad/s?",
    ),
    ('column = "torque"', 'column = "angle"', "found 'angle', which is also joint[0].angle"),
    (
        'column = "torque"',
        'column = "torque", expression = "2 * torque"',
        "expected either column or expression",
    ),
    (
        'column = "torque"',
        'expression = "__import__(1)"',
        "expected numbers and columns with + - * / ( )",
    ),
    (
        'column = "torque"',
        'expression = "torque ** 2"',
        "expected numbers and columns with + - * / ( )",
    ),
    (
        'column = "torque"',
        'expression = "2 * torq"',
        "has no column 'torq'",
        "did you mean torque?",
    ),
    (
        'unit = "rad"',
        'unit = "rad", zero = 1e6',
        "reaches -1e+06 to -1e+06 rad",
        "correct unit, zero",
    ),
    (
        'unit = "rad"',
        'unit = "rad", zero = 1e300',
        "zero: found 1e+300, expected less than or equal to",
    ),
    (
        'unit = "rad"',
        'unit = "rad", sing = -1',
        "joint[0].angle.sing: unknown key; did you mean sign?",
    ),
    (
        'purpose = "train"',
        'purpose = "train"\nspan = [0.7, 0.2]',
        "span: found [0.7, 0.2], expected its start before",
    ),
    (
        'purpose = "train"',
        'purpose = "train"\nspan_s = [50, 60]',
        " from 50 to 60 s has 0 rows of a run of 9.995 s",
    ),
    (
        'purpose = "train"',
        'purpose = "train"\nfiles = "x*"',
        "no [[recording]] matches log.csv, only x*; add one",
    ),
    ('unit = "s"', 'unit = "s"\nrate_hz = 5.0', "expected either column or rate_hz"),
    ('unit = "N·m"', 'unit = "N·m", range = [90, 100]', "pivot_torque_nm has no value in any row"),
    *(
        (
            'name = "whole"',
            f'name = "{name}"',
            "recording[0].name: found",
            "expected a file's name without its folder",
        )
        for name in ("", "../../evil", "/tmp/evil", "a\\u0000b", "c:evil")
    ),
    (
        'name = "whole"',
        'name = "{nosuch}"',
        "recording[0].name: found {nosuch} in '{nosuch}', expected {file}, ",
    ),
    (
        'name = "pivot"',
        'name = "Pivot 1"',
        "joint[0].name: found 'Pivot 1', expected text matching",
    ),
]


@pytest.mark.parametrize(
    ("right", "wrong", "line"), [(a, b, " ... ".join(c)) for a, b, *c in BAD_MAPS]
)
def test_a_wrong_map_is_refused_with_its_key(imported, pendulum, write_csv, right, wrong, line):
    outcome = imported(write_csv(pendulum.columns()), map_text=MAP.replace(right, wrong, 1))
    assert (outcome.code, outcome.out) == (2, "")
    assert len(outcome.err.splitlines()) == 1
    for part in line.split(" ... "):
        assert part in outcome.err
    assert not outcome.folder.exists()
    assert "more)" not in outcome.err  # one slip is one fault


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"", "log.csv: is empty (0 bytes), expected a log"),
        (b"[1, 2, 3]", "log.csv: is a list of numbers without names, expected records with keys"),
        (
            b'time,angle,velocity,torque\n0,1,2,3\n1,"1,2,3\n' + b"2,3,4,5\n" * 90,
            "log.csv: line 3 has an unclosed quotation mark; close it",
        ),
        (b"\n\n\n", "log.csv: is empty, expected a table of numbers"),
        (
            b"time,angle,velocity,torque\n",
            "log.csv: holds no rows of two numbers or more after 'time,angle,velocity",
        ),
        (bytes(range(256)) * 50, "log.csv: is in no known format (it starts with"),
        (b"\x89HDF\r\n\x1a\n" + b"x" * 900, "log.csv: is a damaged or truncated HDF5 file"),
        (b"PAR1" + b"x" * 900, "log.csv: is a damaged or truncated Parquet file"),
        (b"MATLAB 5.0 MAT-file" + b"x" * 900, "log.csv: is a damaged .mat file"),
        (b"\x89MCAP0\r\n" + b"x" * 900, "log.csv: is no ROS bag that can be read"),
        (b"SQLite format 3\0" + b"x" * 900, "log.csv: is no ROS bag that can be read"),
        (b'{"a": [1, 2', "log.csv: is not valid JSON"),
        (b'{"name": "nothing"}', "has no column 'time'"),
        (b"time;angle\n1,2,3\nfoo\n", "has no column"),
        (b"dear diary,\ntoday I measured nothing.\n", "holds no rows of two numbers or more"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_file_that_is_no_log_is_refused(imported, tmp_path, content, line):
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    outcome = imported(path)
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert line in outcome.err


def test_a_file_that_is_not_there_is_refused(imported, tmp_path):
    assert imported(tmp_path / "log.csv").err.endswith("log.csv: no such file; check the name\n")
    assert "is a folder, expected a log or the folder of a ROS 2 bag" in imported(tmp_path).err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="without named pipes")
def test_a_pipe_is_refused_and_not_waited_for(imported, pendulum, write_csv, tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe.csv")
    outcome = imported(tmp_path / "pipe.csv")
    assert outcome.code == 2
    assert (
        "pipe.csv: is a pipe or a device, expected a file; write its content to a file"
        in outcome.err
    )
    log, folder = str(write_csv(pendulum.columns())), str(tmp_path / "recordings")
    assert run(["import", log, "--map", str(tmp_path / "pipe.csv"), "-o", folder]) == 2
    assert "pipe.csv: is a pipe or a device, expected the file of a map" in capsys.readouterr().err


def test_a_link_to_nothing_says_to_what(imported, pendulum, write_csv, tmp_path, capsys):
    for name in ("log.csv", "map.toml.csv"):
        (tmp_path / name).symlink_to("nowhere.csv")
    link = "it is a symbolic link to nowhere.csv, which is missing; correct the link"
    message = f"no such file; {link}"
    assert f"log.csv: {message}" in imported(tmp_path / "log.csv").err
    log = str(write_csv(pendulum.columns(), name="other.csv"))
    assert (
        run(
            [
                "import",
                log,
                "--map",
                str(tmp_path / "map.toml.csv"),
                "-o",
                str(tmp_path / "recordings"),
            ]
        )
        == 2
    )
    assert message in capsys.readouterr().err


def test_a_folder_that_is_called_as_a_recordings_file_is_refused_with_what_is_meant(
    pendulum, write_csv, tmp_path, capsys
):
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    where = ["--map", str(tmp_path / "map.toml"), "-o", str(tmp_path / "made" / "x.parquet")]
    assert run(["import", str(write_csv(pendulum.columns())), *where]) == 2
    err = capsys.readouterr().err
    assert "x.parquet: is a file name, expected the folder of all recordings, such as -o" in err
    assert 'name = "x" at [[recording]] in the map' in err and len(err.splitlines()) == 1
    assert not (tmp_path / "made").exists()


SLIPS = [
    *(
        (
            "[time]",
            f"[source]\ndelimiter = {d}\n[time]",
            "source.delimiter: found",
            "expected one character, such as",
        )
        for d in ('"::"', '", "', '"tab"', "'\\s+'", '""')
    ),
    (
        'column = "torque"',
        'expression = "5.0"',
        "torque.expression: found '5.0', expected",
        "one column at least",
    ),
    (
        'column = "torque"',
        f'expression = "torque * {"9" * 500}"',
        "torque.expression: found 'torque * 999",
        "expected",
    ),
    (
        'column = "torque"',
        'expression = "1e999 * torque"',
        "torque.expression: found '1e999 * torque', expected",
    ),
    (
        'column = "torque"',
        f'expression = "torque{" + torque" * 5000}"',
        "expression: found 'torque + ",
        "expected",
    ),
    (
        'column = "torque"',
        f'expression = "{"-" * 300}torque"',
        "at most 100 operations; compute a column",
    ),
    (
        'column = "torque"',
        f'expression = "{"(" * 500}torque{")" * 500}"',
        "torque.expression: found '((((",
        "expected",
    ),
]


ABSURD = [
    (
        "",
        "\n[geometry]\ngravity_m_s2 = 981",
        "geometry.gravity_m_s2: found 981, expected less than or equal to 30",
    ),
    (
        'unit = "N·m"',
        'unit = "N·m", scale = 1e300',
        "scale: found 1e+300, expected 1e-12 to 1e+12 in size",
    ),
    ('unit = "N·m"', 'unit = "N·m", scale = 0', "scale: found 0, expected 1e-12 to 1e+12 in size"),
    (
        'unit = "N·m"',
        'unit = "N·m", scale = 1e9',
        "joint[0].torque: reaches",
        "expected at most 1e+06 N·m",
        "Exclude outliers",
    ),
    ('unit = "N·m"', 'unit = "N·m", gear_ratio = 1e300', "gear_ratio: found 1e+300, expected"),
    (
        "",
        "period_s = 1e9",
        "recording.period_s: found 1e+09 (train), expected at most the 9.995 s of the run",
    ),
]


@pytest.mark.parametrize(
    ("right", "wrong", "parts"), [(a, b, c) for a, b, *c in ABSURD], ids=range(len(ABSURD))
)
def test_what_no_machine_has_is_refused_with_what_is_expected(
    imported, pendulum, write_csv, right, wrong, parts
):
    text = MAP.replace(right, wrong, 1) if right else MAP + wrong
    outcome = imported(write_csv(pendulum.columns()), map_text=text)
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1), outcome.err
    assert all(part in outcome.err for part in parts), outcome.err


def test_a_period_of_all_the_run_is_none_too_long(imported, pendulum, write_csv):
    assert imported(write_csv(pendulum.columns()), map_text=MAP + "period_s = 10.0").code == 0


def test_a_torque_that_no_drive_delivers_is_refused_with_its_instant_until_it_is_left_out(
    imported, pendulum, write_csv
):
    torque = pendulum.torque.copy()
    torque[100] = 1e35
    path = write_csv(pendulum.columns() | {"torque": torque})
    outcome = imported(path)
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert "1e+35 N·m, expected at most 1e+06 N·m either way (1 row of" in outcome.err
    assert "the first 1e+35 at 0.5 s" in outcome.err
    mended = imported(
        path, map_text=MAP.replace('unit = "N·m"', 'unit = "N·m", range = [-100, 100]')
    )
    assert (mended.code, len(mended.recording().frame)) == (0, 1999)


def test_a_single_reading_far_from_all_others_is_reported_with_its_instant(
    imported, pendulum, write_csv
):
    torque = pendulum.torque.copy()
    torque[100] = 500.0
    printed = imported(write_csv(pendulum.columns() | {"torque": torque})).printed
    assert "pivot_torque_nm: 1 row far off, the first 500 at 0.5 s; 99 % lie between" in printed
    assert "far off" not in imported(write_csv(pendulum.columns())).printed


@pytest.mark.parametrize(
    ("right", "wrong", "parts"), [(a, b, c) for a, b, *c in SLIPS], ids=range(len(SLIPS))
)
def test_a_slip_in_a_map_is_the_users_to_mend(imported, pendulum, write_csv, right, wrong, parts):
    outcome = imported(write_csv(pendulum.columns()), map_text=MAP.replace(right, wrong, 1))
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1), outcome.err
    assert all(part in outcome.err for part in parts), outcome.err


def test_a_parquet_file_with_a_column_twice_or_damaged_pages_is_named(imported, pendulum, tmp_path):
    columns = pendulum.columns()
    twice = pa.Table.from_arrays([*columns.values(), columns["angle"]], [*columns, "angle"])
    pq.write_table(twice, tmp_path / "twice.parquet")
    outcome = imported(tmp_path / "twice.parquet")
    assert (outcome.code, "twice.parquet: has two columns 'angle'" in outcome.err) == (
        2,
        True,
    ), outcome.err
    path = tmp_path / "damaged.parquet"
    pq.write_table(pa.table(columns), path, compression="snappy", use_dictionary=False)
    damaged = bytearray(path.read_bytes())
    damaged[100:9000] = b"\xff" * 8900
    path.write_bytes(damaged)
    outcome = imported(path)
    assert (
        outcome.code,
        "damaged.parquet: is a damaged or truncated Parquet file" in outcome.err,
    ) == (2, True), outcome.err


def test_a_data_set_is_no_group_and_an_empty_one_no_column(imported, pendulum, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, values in pendulum.columns().items():
            file[name] = values
        file["empty"] = np.empty((0, 3))
    assert imported(tmp_path / "log.h5").code == 0
    outcome = imported(tmp_path / "log.h5", map_text=f'[source]\ntable = "angle"\n{MAP}')
    assert (
        outcome.code,
        "names 'angle', which is a data set, expected a group" in outcome.err,
    ) == (2, True)


def test_json_that_is_nested_without_end_is_refused(imported, tmp_path):
    (tmp_path / "log.json").write_text('{"a":' * 5000 + "1" + "}" * 5000)
    outcome = imported(tmp_path / "log.json")
    assert (
        outcome.code,
        "log.json: nests lists or tables too deeply" in outcome.err,
    ) == (2, True)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_an_unreadable_file_is_refused(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    path.chmod(0)
    outcome = imported(path)
    assert (outcome.code, "Permission denied" in outcome.err) == (2, True)


@pytest.mark.parametrize(("beyond", "where"), [(",5", "row 699"), (",5,6", "line 701")])
def test_a_line_with_too_many_fields_is_refused(imported, pendulum, write_csv, beyond, where):
    path = write_csv(pendulum.columns())
    lines = path.read_text().splitlines()
    lines[700] += beyond
    path.write_text("\n".join(lines))
    outcome = imported(path)
    assert (outcome.code, f"{where} has more than the 4 fields" in outcome.err) == (2, True)


def test_a_log_that_was_cut_off_loses_its_last_line_only(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    text = path.read_text()
    path.write_text(text[: text.rstrip().rindex(",")])
    outcome = imported(path)
    assert (outcome.code, len(outcome.recording().frame)) == (0, 1999)
    assert "pivot_torque_nm: no value in 1 row; rows left out" in outcome.printed


def test_a_recording_that_was_measured_is_never_overwritten(imported, pendulum, write_csv):
    path = write_csv(pendulum.columns())
    first = imported(path)
    assert imported(path).code == 0  # what was imported may be imported again
    table = first.recording()
    metadata = {key: value for key, value in table.metadata.items() if key != "imported"}
    RECORDING.write(first.folder / "whole.parquet", table.frame, metadata)
    outcome = imported(path)
    assert (
        outcome.code,
        "holds a recording that was not imported, not overwritten" in outcome.err,
    ) == (2, True)


def test_a_name_that_stands_twice_is_reported_and_refused_where_the_map_uses_it(
    imported, pendulum, write_csv
):
    columns = pendulum.columns() | {"again": np.zeros(len(pendulum.time))}
    path = write_csv(columns)
    path.write_text(path.read_text().replace("again", "angle", 1))
    refused = imported(path)
    assert (refused.code, len(refused.err.splitlines())) == (2, 1)
    assert "has 'angle' twice, which joint[0].angle in" in refused.err
    assert "name angle#1, angle#2 ... in the map" in refused.err
    first = imported(path, map_text=MAP.replace('"angle"', '"angle#1"'))
    np.testing.assert_allclose(first.recording().frame["pivot_angle_rad"], pendulum.angle)
    assert (
        first.recording().metadata["imported"]["notes"][-1]
        == "columns with the same name are angle#1, angle#2"
    )
    unused = path.with_name("unused.csv")
    unused.write_text(path.read_text().replace("angle", "note").replace("note", "angle", 1))
    assert imported(path, map_text=MAP.replace('"angle"', '"angle#2"')).code == 0


def test_a_column_that_is_missing_is_sought_beside_its_own(imported, pendulum, write_csv):
    columns = {"time": pendulum.time, "leg.data": pendulum.angle, "arm.q": pendulum.angle}
    path = write_csv(columns | {"arm.torque": pendulum.torque})
    refused = imported(path, map_text=MAP.replace('"angle"', '"arm.data"'))
    assert refused.code == 2 and refused.err.rstrip().endswith("did you mean arm.q?")


def test_a_log_too_short_for_its_spans_says_from_when_to_when(imported, pendulum, write_csv):
    columns = {name: values[:30] for name, values in pendulum.columns().items()}
    outcome = imported(write_csv(columns), map_text=MAP.partition("[[recording]]")[0])
    assert "validate from 0.1015 to 0.145 s has 9 rows of a run of 0.145 s" in outcome.err


def test_two_files_do_not_become_one_recording(imported, pendulum, write_csv):
    files = [write_csv(pendulum.columns(), name=name) for name in ("a.csv", "b.csv")]
    outcome = imported(*files)
    assert outcome.code == 2
    assert "whole.parquet would replace that of" in outcome.err
    assert "with {file} in them" in outcome.err
    assert not outcome.folder.exists()


def test_a_file_that_is_refused_takes_those_before_it_along(
    imported, pendulum, write_csv, tmp_path
):
    """Of what was there before nothing changes, and nothing new is half there."""
    text = MAP.replace('"whole"', '"{file}"')
    good, bad = write_csv(pendulum.columns(), name="good.csv"), tmp_path / "bad.csv"
    bad.write_text("dear diary")
    outcome = imported(good, bad, map_text=text)
    assert (outcome.code, outcome.out, outcome.folder.exists()) == (2, "", False)
    other = write_csv(pendulum.columns(), name="other.csv")
    outcome = imported(good, other, map_text=text)
    assert sorted(path.name for path in outcome.folder.iterdir()) == [
        "good.parquet",
        "other.parquet",
    ]


def test_what_trains_does_not_validate(exoid, imported, pendulum, write_csv, tmp_path):
    """Neither by one map, nor by two maps of the same log."""
    path = write_csv(pendulum.columns())
    validate = '[[recording]]\nname = "judge"\npurpose = "validate"\n'
    outcome = imported(path, map_text=f"{MAP}span = [0.0, 0.6]\n{validate}span_s = [5.0, 10.0]\n")
    assert (outcome.code, outcome.folder.exists()) == (2, False)
    assert (
        "log.csv: 5 to 5.995 s is both to train and to validate, expected no common sample"
        in outcome.err
    )
    assert (
        imported(path, map_text=f"{MAP}span = [0.0, 0.6]\n{validate}span = [0.6, 1.0]\n").code == 0
    )
    again = imported(path, map_text=MAP)
    files = [again.folder / name for name in ("whole.parquet", "judge.parquet")]
    outcome = exoid("identify", *files, "-o", tmp_path / "identified")
    assert outcome.code == 2
    assert (
        "have 800 rows of log.csv in common, expected none: validation needs data that no fit"
        in outcome.err
    )


def test_ctrl_c_leaves_no_half_recording(pendulum, write_csv, tmp_path):
    path = write_csv(pendulum.columns())
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    code = (
        "import os, signal; from pipelines.importing import recordings as r; from exoid_cli.app"
        " import run; of = r.ImportedRecording; real = of.pieces\ndef pieces(self):\n"
        "  yield next(real(self)); os.kill(os.getpid(), signal.SIGINT); yield None\n"
        f"of.pieces = pieces\nfolder = {str(tmp_path)!r}\n"
        f"raise SystemExit(run(['import', {str(path)!r}, '--map', folder + '/map.toml',"
        " '-o', folder + '/out']))"
    )
    stopped = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120
    )
    assert (stopped.returncode, stopped.stderr) == (130, "exoid: stopped by Ctrl-C\n")
    assert not (tmp_path / "out").exists()


def test_a_log_of_fewer_than_ten_rows_is_too_short_and_its_map_not_blamed(
    imported, pendulum, write_csv
):
    columns = {name: values[:5] for name, values in pendulum.columns().items()}
    path = write_csv(columns)
    outcome = imported(path)
    assert (outcome.code, outcome.err) == (
        2,
        f"exoid: {path}: found 5 rows, a recording needs at least 10; log for longer\n",
    )


def test_a_clock_of_which_no_run_is_long_enough_is_reported_with_how_long_they_are(
    imported, pendulum, write_csv
):
    columns = {name: values[:30] for name, values in pendulum.columns().items()}
    columns["time"] = np.where(np.arange(30) < 5, columns["time"], np.nan)
    outcome = imported(write_csv(columns))
    assert outcome.code == 2
    assert (
        "starts over too often: the longest run has 5 of 30 rows, expected at least 10; correct"
        in outcome.err
    )


def test_a_joint_that_never_moves_is_reported(imported, pendulum, write_csv):
    outcome = imported(write_csv(pendulum.columns() | {"angle": np.full(2000, 0.3)}))
    assert "pivot_angle_rad: is 0.3 in every row; it carries no information" in outcome.printed
    assert "out of the map" not in outcome.printed  # without it nothing is left


SECOND = """
[[joint]]
name = "knee"
angle = { column = "knee", unit = "rad" }
torque = { column = "tau", unit = "N·m" }

"""


def test_a_joint_that_rests_in_one_log_may_move_in_others(imported, pendulum, write_csv):
    text = MAP.replace("[[recording]]", SECOND + "[[recording]]")
    outcome = imported(
        write_csv(pendulum.columns() | {"knee": np.full(2000, 0.3), "tau": pendulum.torque}),
        map_text=text,
    )
    assert (
        "validate on a run in which it moves, or for a joint that rests in all" in outcome.printed
    )


def test_a_sliding_joints_voltage_asks_for_its_own_gain_and_not_for_a_screw_alone():
    with pytest.raises(
        ValueError, match=r"^needs lead_m, or gain_n_v in place of gain_nm_v; add it"
    ):
        gain("voltage", "force", {"gain_nm_v": 2.0}, 1.0)
    with pytest.raises(ValueError, match=r"^needs gain_n_v; add it"):
        gain("voltage", "force", {}, 1.0)


def test_one_wild_angle_is_refused_with_its_instant_and_what_leaves_it_out(
    imported, pendulum, write_csv
):
    columns = {name: np.array(values, dtype=float) for name, values in pendulum.columns().items()}
    columns["angle"][100] = 99.0
    outcome = imported(write_csv(columns))
    assert outcome.code == 2 and len(outcome.err.splitlines()) == 1
    assert (
        f"(1 row of {len(columns['angle'])} beyond, the first 99 at"
        f" {columns['time'][100]:.6g} s" in outcome.err
    )
    assert "Exclude outliers with range" in outcome.err


def test_a_column_of_text_is_refused_with_the_text(imported, pendulum, write_csv):
    columns = dict(pendulum.columns())
    columns["torque"] = ["ERR"] * len(columns["angle"])
    outcome = imported(write_csv(columns))
    assert outcome.code == 2 and "has no value in any row (torque: " in outcome.err
    assert "rows with text, the first 'ERR' in row 0" in outcome.err
