"""Every refusal of a reader or writer, by the full text that a user sees."""

from decimal import Decimal
from itertools import pairwise

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipelines.contracts import (
    CANDIDATES,
    MOTION,
    PARAMETERS,
    RECORDING,
    RESIDUALS,
    SIMULATION,
    Joint,
    contract_of,
)
from pipelines.contracts import parquet as storage
from pipelines.contracts.table import per_joint
from pipelines.errors import ContractError


def refusal(action, *arguments) -> str:
    with pytest.raises(ContractError) as caught:
        action(*arguments)
    return str(caught.value)


def test_what_is_written_is_read_again(tmp_path, swinging_leg, run_metadata):
    swinging_leg["note"] = "extra columns stay"
    metadata = {
        **run_metadata,
        "lab": {"room": 3},
        "gaps": [[0.1, 2]],
        "sample_rate_hz": np.float64(200.0),
    }
    RECORDING.write(tmp_path / "new folder" / "a.parquet", swinging_leg, metadata)
    table = RECORDING.read(tmp_path / "new folder" / "a.parquet")
    assert table.frame.equals(swinging_leg)
    assert table.metadata == {**metadata, "contract": "recording/1"}
    assert table.stacked("angle").shape == (100, 2)
    assert contract_of(table.path) is RECORDING


def test_a_motion_has_every_column_of_a_recording_by_the_same_description():
    of_motion = {column.name: column for column in MOTION.columns}
    for column in RECORDING.columns:
        assert column.name in of_motion
        if not column.required and column.name != "velocity":
            assert of_motion[column.name] == column


def test_a_column_of_a_quantity_without_a_unit_is_refused_where_it_is_declared():
    with pytest.raises(ValueError, match=r"^voltage: has no unit; add it to QUANTITIES of"):
        per_joint("voltage", "motor voltage")


def test_unit_and_meaning_travel_with_the_column(tmp_path, swinging_leg, run_metadata):
    RECORDING.write(tmp_path / "a.parquet", swinging_leg, run_metadata)
    field = pq.read_schema(tmp_path / "a.parquet").field("hip_torque_nm")
    assert field.metadata == {
        b"unit": "N·m".encode(),
        b"meaning": b"what the drive delivers at the joint",
    }


def test_a_prismatic_axis_has_columns_of_its_own(tmp_path, swinging_leg, run_metadata):
    axis = Joint("axis", "prismatic")
    assert [axis.column(q) for q in ("angle", "torque", "velocity")] == [
        "axis_position_m",
        "axis_force_n",
        "axis_velocity_m_s",
    ]
    # 12 m is no angle in degrees.
    frame = swinging_leg[["time_s"]].assign(axis_position_m=12.0, axis_force_n=1.0)
    metadata = {**run_metadata, "joints": [{"name": "axis", "kind": "prismatic"}]}
    RECORDING.write(tmp_path / "a.parquet", frame, metadata)
    assert RECORDING.read(tmp_path / "a.parquet").joints == (axis,)


def test_numbers_of_other_types_are_converted_where_nothing_is_lost(
    tmp_path, swinging_leg, run_metadata
):
    swinging_leg["hip_angle_rad"] = swinging_leg["hip_angle_rad"].astype("float32")
    swinging_leg["knee_angle_rad"] = -1
    swinging_leg["hip_torque_nm"] = [Decimal("0.5")] * 100
    swinging_leg["sequence"] = np.arange(100.0)
    RECORDING.write(tmp_path / "a.parquet", swinging_leg, run_metadata)
    frame = RECORDING.read(tmp_path / "a.parquet").frame
    assert [str(frame[name].dtype) for name in frame.columns] == ["float64"] * 5 + ["int64"]
    assert frame["hip_torque_nm"].eq(0.5).all()


def test_lists_and_structs_keep_their_types_even_when_empty(tmp_path):
    joints = {
        f"rmse_{when}_{joint}_nm": [1.0, np.nan]
        for when in ("before", "after")
        for joint in ("hip", "knee")
    }
    gains = {
        f"{name}": [1.0, None] for name in ("train_score", "gain_nm", "gain_low_nm", "gain_high_nm")
    }
    frame = pd.DataFrame(
        {
            "rank": [1, 2],
            "causes": [["parallel_spring@knee"], []],
            "parameters": [[{"name": "stiffness", "value": 8, "unit": "N·m/rad"}], []],
            "probability": [0.9, None],
            "verdict": ["named", "rejected"],
            "reason": ["it earns its place", "nothing left to explain"],
            **joints,
            **gains,
        }
    )
    CANDIDATES.write(tmp_path / "c.parquet", frame, {})
    table = CANDIDATES.read(tmp_path / "c.parquet")
    # What was read can be written.
    CANDIDATES.write(tmp_path / "c.parquet", table.frame, table.metadata)
    schema = pq.read_schema(tmp_path / "c.parquet")
    assert (
        str(schema.field("parameters").type)
        == "list<element: struct<name: string, value: double, unit: string>>"
    )
    assert table.frame["parameters"][0][0]["value"] == 8.0


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "no such file; check the name, or make it first"),
        (b"", "is empty (0 bytes), expected a Parquet file; copy or make it again"),
        (
            b"time,angle\n",
            (
                "is not a Parquet file (it starts with b'time', expected b'PAR1'); name a file that"
                " exoid wrote"
            ),
        ),
        (b"PAR1 and no more", "is a damaged or truncated Parquet file; copy or make it again"),
    ],
    ids=["missing", "empty", "text", "truncated"],
)
def test_what_is_no_parquet_file_is_refused(tmp_path, content, text):
    path = tmp_path / "a.parquet"
    if content is not None:
        path.write_bytes(content)
    assert refusal(RECORDING.read, path) == f"{path}: {text}"


@pytest.mark.parametrize("lines", [[], [2, 4], [1, 3, 10]])
def test_excited_lines_that_are_not_odd_are_refused(tmp_path, swinging_leg, run_metadata, lines):
    metadata = {**run_metadata, "excited_lines": lines}
    with pytest.raises(ContractError, match=r"excited_lines: found \[.*\], expected odd numbers"):
        RECORDING.write(tmp_path / "a.parquet", swinging_leg, metadata)


def test_a_file_cut_short_anywhere_is_refused(tmp_path, swinging_leg, run_metadata):
    RECORDING.write(tmp_path / "a.parquet", swinging_leg, run_metadata)
    whole = (tmp_path / "a.parquet").read_bytes()
    cut = tmp_path / "cut.parquet"
    for length in range(4, len(whole), len(whole) // 20):
        cut.write_bytes(whole[:length])
        assert (
            refusal(RECORDING.read, cut)
            == f"{cut}: is a damaged or truncated Parquet file; copy or make it again"
        )


def test_a_folder_is_refused(tmp_path, swinging_leg, run_metadata):
    assert (
        refusal(RECORDING.read, tmp_path)
        == f"{tmp_path}: is a folder, expected a Parquet file; name a file in it"
    )
    assert (
        refusal(RECORDING.write, tmp_path, swinging_leg, run_metadata)
        == f"{tmp_path}: is a folder, expected the name of a Parquet file to write"
    )


def test_a_mistyped_name_is_not_taken_for_one_of_another_file(tmp_path, swinging_leg, run_metadata):
    RECORDING.write(tmp_path / "exo_alone_train.parquet", swinging_leg, run_metadata)
    slip = refusal(RECORDING.read, tmp_path / "exo_alone_trian.parquet")
    assert slip.endswith(f"no such file; did you mean {tmp_path / 'exo_alone_train.parquet'}?")
    other = refusal(RECORDING.read, tmp_path / "with_human_train.parquet")
    assert other.endswith("no such file; check the name, or make it first")


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        (
            None,
            (
                "has no `exoid` entry in its schema metadata, so exoid did not write it; `exoid"
                ' import` makes a recording of a log; for a table of your own add {"contract":'
                ' "<name>/<version>"}, see docs/contracts.md'
            ),
        ),
        (
            b"{",
            (
                "its `exoid` metadata is not JSON (Expecting property name enclosed in double"
                " quotes: line 1 column 2 (char 1)); write it again"
            ),
        ),
        (
            b"[]",
            (
                'its `exoid` metadata names no contract; it must hold at least {"contract":'
                ' "<name>/<version>"}'
            ),
        ),
        (
            b'{"contract": "motion/1"}',
            "holds motion/1, expected recording/1; `exoid acquire` makes a recording file",
        ),
        (
            b'{"contract": "recording/9"}',
            (
                "holds recording/9, but exoid 0.1.0 knows recording/1; "
                "update exoid, or make the file again with `exoid acquire`"
            ),
        ),
    ],
)
def test_a_file_of_another_contract_is_refused(tmp_path, swinging_leg, entry, text):
    path = tmp_path / "a.parquet"
    table = pa.Table.from_pandas(swinging_leg)
    pq.write_table(table.replace_schema_metadata({b"exoid": entry} if entry else None), path)
    assert refusal(RECORDING.read, path) == f"{path}: {text}"


def test_an_unknown_contract_is_named_with_the_known_ones(tmp_path, swinging_leg):
    path = tmp_path / "a.parquet"
    storage.save(path, [pa.Table.from_pandas(swinging_leg)], {"contract": "gait/1"})
    assert (
        refusal(contract_of, path)
        == f"{path}: holds gait/1, which exoid does not know; it knows trajectory/1, recording/1,"
        " motion/1, parameters/1, residuals/1, candidates/1, simulation/1"
    )


def _set(name, row, value):
    def spoil(frame):
        if isinstance(value, str):
            frame[name] = frame[name].astype(object)
        frame.loc[row, name] = value
        return frame

    return spoil


REFUSED_FRAMES = {
    "missing column": (
        lambda frame: frame.drop(columns="knee_torque_nm"),
        (
            "column knee_torque_nm is missing, expected what the drive delivers at the joint (N·m);"
            " a recording/1 table must have it"
        ),
    ),
    "text for a number": (
        lambda frame: frame.assign(hip_angle_rad="0.1"),
        (
            "column hip_angle_rad: found type large_string, expected float64; write the column as"
            " float64"
        ),
    ),
    "a truth for a number": (
        lambda frame: frame.assign(hip_angle_rad=True),
        "column hip_angle_rad: found type bool, expected float64; write the column as float64",
    ),
    "a number that does not fit": (
        lambda frame: frame.assign(sequence=0.5),
        (
            "column sequence: found type float64, whose values int64 cannot hold "
            "(Float value 0.500000 was truncated converting to int64); write the column as int64"
        ),
    ),
    "mixed values": (
        _set("hip_angle_rad", 3, "x"),
        (
            "column hip_angle_rad: its values have no common type "
            "(Could not convert 'x' with type str: tried to convert to double); give them one"
        ),
    ),
    "NaN": (
        _set("hip_angle_rad", 12, np.nan),
        (
            "column hip_angle_rad, row 12: found NaN, expected a finite number; correct or drop"
            " the row and write the file again"
        ),
    ),
    "infinity": (
        _set("hip_torque_nm", 7, -np.inf),
        (
            "column hip_torque_nm, row 7: found -inf, expected a finite number; correct or drop"
            " the row and write the file again"
        ),
    ),
    "infinity where NaN may be": (
        lambda frame: _set("hip_current_a", 5, np.inf)(frame.assign(hip_current_a=np.nan)),
        (
            "column hip_current_a, row 5: found inf, expected a finite number; correct or drop"
            " the row and write the file again"
        ),
    ),
    "time backwards": (
        _set("time_s", 40, 0.05),
        (
            "column time_s, row 40: found 0.05 after 0.195, expected strictly increasing time; sort"
            " the rows and drop repeated ones"
        ),
    ),
    "time that stands still": (
        _set("time_s", 40, 0.195),
        (
            "column time_s, row 40: found 0.195 after 0.195, expected strictly increasing time;"
            " sort the rows and drop repeated ones"
        ),
    ),
    "more than any machine has": (
        _set("hip_torque_nm", 7, -1e300),
        (
            "column hip_torque_nm, row 7: found -1e+300, expected at most 1e+12; correct the unit"
            " or scale of the column, or drop the row"
        ),
    ),
    "degrees": (
        lambda frame: frame.assign(knee_angle_rad=np.linspace(-5, -60, 100)),
        (
            "column knee_angle_rad, row 8: found -9.44444, which looks like degrees; expected"
            " radians, multiply by pi/180"
        ),
    ),
    "no rows": (
        lambda frame: frame.iloc[:0],
        "holds no rows, expected at least one; `exoid acquire` makes it again",
    ),
}


@pytest.mark.parametrize("fault", REFUSED_FRAMES)
def test_a_table_that_breaks_its_contract_is_refused(swinging_leg, run_metadata, fault):
    spoil, text = REFUSED_FRAMES[fault]
    message = refusal(RECORDING.check, spoil(swinging_leg), run_metadata, "a.parquet")
    assert message == f"a.parquet: {text}"


def test_reading_refuses_what_writing_refuses(tmp_path, swinging_leg, run_metadata):
    swinging_leg.loc[12, "hip_angle_rad"] = np.nan
    path = tmp_path / "a.parquet"
    storage.save(
        path, [pa.Table.from_pandas(swinging_leg)], {**run_metadata, "contract": "recording/1"}
    )
    assert refusal(RECORDING.read, path).startswith(
        f"{path}: column hip_angle_rad, row 12: found NaN"
    )


def test_a_name_that_stands_twice_is_refused(swinging_leg, run_metadata):
    frame = swinging_leg.rename(columns={"knee_angle_rad": "hip_angle_rad"})
    assert (
        refusal(RECORDING.check, frame, run_metadata, "a.parquet")
        == "a.parquet: column hip_angle_rad occurs twice, expected each name once; rename one"
    )


CORRECT = "; correct it in the file's `exoid` entry"
REFUSED_METADATA = [
    ({"run": None}, "metadata run: found None, expected 'exo_alone' or 'with_human'"),
    ({"run": "walking"}, "metadata run: found 'walking', expected 'exo_alone' or 'with_human'"),
    ({"sample_rate_hz": "200"}, "metadata sample_rate_hz: found '200', expected a valid number"),
    ({"sample_rate_hz": 0}, "metadata sample_rate_hz: found 0, expected greater than 0"),
    ({"gaps": [[1.0, 2], [2.0, 0]]}, "metadata gaps[1][1]: found 0, expected greater than 0"),
    (
        {"geometry": {"thigh_length_m": -1.0}, "period_s": "10"},
        "metadata period_s: found '10', expected a valid number (and 1 more)",
    ),
    (
        {"controller": {"hip": {"type": "pd", "kp_nm_rad": "stiff"}}},
        "metadata controller.hip.kp_nm_rad: found 'stiff', expected a valid number",
    ),
    ({"controller": {"hip": {}}}, "metadata controller.hip.type: missing; add it"),
    (
        {"joints": [{"name": "Hip"}]},
        "metadata joints[0].name: found 'Hip', expected text matching '^[a-z][a-z0-9_]*$'",
    ),
    (
        {"joints": [{"name": "a"}, {"name": "a"}]},
        "metadata joints: found joints a, a, expected each name once",
    ),
    (
        {"created_at": "noon"},
        (
            "metadata created_at: found 'noon', expected an ISO 8601 time such as"
            " 2025-01-31T12:00:00+00:00"
        ),
    ),
]


@pytest.mark.parametrize(("keys", "text"), REFUSED_METADATA)
def test_metadata_that_break_the_contract_are_refused(swinging_leg, run_metadata, keys, text):
    message = refusal(RECORDING.check, swinging_leg, {**run_metadata, **keys}, "a.parquet")
    assert message == f"a.parquet: {text}{CORRECT}"


def test_metadata_that_json_cannot_hold_are_refused(swinging_leg, run_metadata):
    text = refusal(
        RECORDING.check, swinging_leg, {**run_metadata, "noise": float("nan")}, "a.parquet"
    )
    assert text.startswith(
        "a.parquet: metadata cannot be written as JSON (Out of range float values"
    )


def test_time_starts_anew_with_each_file_of_residuals(swinging_leg):
    state = {
        f"{joint}_{quantity}": 0.0
        for joint in ("hip", "knee")
        for quantity in ("velocity_rad_s", "acceleration_rad_s2", "predicted_nm", "residual_nm")
    }
    frame = swinging_leg.assign(
        **state, run="exo_alone", purpose="train", segment=0, model="baseline", scored=True
    )
    both = pd.concat([frame.assign(file="a"), frame.assign(file="b")], ignore_index=True)
    RESIDUALS.check(both, {})
    text = refusal(RESIDUALS.check, both.assign(file="a"), {}, "r.parquet")
    assert text.startswith("r.parquet: column time_s, row 100: found 0.0 after 0.495")
    assert (
        refusal(RESIDUALS.check, both.assign(model="best"), {}, "r.parquet")
        == "r.parquet: column model, row 0: found 'best', expected one of baseline, extended;"
        " correct the value"
    )


def test_a_diverging_simulation_is_not_taken_for_a_wrong_unit(swinging_leg):
    quantities = ("reference_rad", "velocity_rad_s", "error_rad", "network_nm")
    frame = swinging_leg.assign(
        **{f"{joint}_{quantity}": 100.0 for joint in ("hip", "knee") for quantity in quantities}
    )
    SIMULATION.check(
        frame.assign(hip_angle_rad=500.0, knee_torque_nm=1e20, hip_network_nm=np.nan), {}
    )


def test_the_covariance_has_a_row_for_each_parameter():
    frame = pd.DataFrame(
        {
            "name": ["X1"],
            "symbol": ["X1"],
            "joint": [None],
            "run": [None],
            "value": [1.0],
            "unit": ["kg·m²"],
            "std_error": [None],
            "ci95_low": [None],
            "ci95_high": [None],
            "step": ["inertia"],
            "effect": ["rigid_body"],
        }
    )
    PARAMETERS.check(frame, {"covariance": [[1.0]]})
    assert (
        refusal(PARAMETERS.check, frame, {"covariance": [[1.0, 0.0]]}, "p.parquet")
        == "p.parquet: metadata covariance: found 1 rows of [2] values, expected 1 x 1, "
        "one for each parameter in row order; write the whole matrix"
    )


def test_nothing_but_an_older_version_of_itself_is_overwritten(
    tmp_path, swinging_leg, run_metadata
):
    path, notes, left_over = (
        tmp_path / name for name in ("a.parquet", "notes.parquet", "cut.parquet")
    )
    RECORDING.write(path, swinging_leg, run_metadata)
    RECORDING.write(path, swinging_leg, run_metadata)
    notes.write_text("a month of work")
    left_over.write_bytes(path.read_bytes()[:-100])
    RECORDING.write(left_over, swinging_leg, run_metadata)
    assert (
        refusal(MOTION.refuse_place, path)
        == f"{path}: holds recording/1, not overwritten with motion/1; choose another name or"
        " remove it"
    )
    assert (
        refusal(RECORDING.write, notes, swinging_leg, run_metadata)
        == f"{notes}: holds no Parquet table, not overwritten with recording/1; choose another name"
        " or remove it"
    )
    assert notes.read_text() == "a month of work"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path, swinging_leg, run_metadata, monkeypatch, error
):
    path = tmp_path / "a.parquet"
    RECORDING.write(path, swinging_leg, run_metadata)
    before = path.read_bytes()

    def half_written(writer, table, **options):
        raise error

    monkeypatch.setattr(storage.pq.ParquetWriter, "write_table", half_written)
    with pytest.raises(type(error)):
        RECORDING.write(path, swinging_leg, run_metadata)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_motion_needs_what_a_recording_lacks(swinging_leg, run_metadata):
    assert (
        refusal(MOTION.check, swinging_leg, run_metadata, "a.parquet")
        == "a.parquet: column hip_angle_measured_rad is missing, expected measured joint angle"
        " (rad); "
        "a motion/1 table must have it"
    )


def test_a_damaged_page_is_one_line_that_names_the_file(tmp_path, swinging_leg, run_metadata):
    path = tmp_path / "a.parquet"
    RECORDING.write(path, swinging_leg, run_metadata)
    content = bytearray(path.read_bytes())
    content[4:400] = bytes(396)
    path.write_bytes(content)
    assert (
        refusal(RECORDING.load, path)
        == f"{path}: is a damaged or truncated Parquet file; copy or make it again"
    )


def test_a_journal_is_recognised_and_its_whole_samples_are_counted(tmp_path):
    path = tmp_path / "a.parquet.journal"
    batch = pa.record_batch({"time_s": [0.0, 0.005, 0.01]})
    with open(path, "wb") as file, pa.ipc.new_stream(file, batch.schema) as stream:
        stream.write_batch(batch)
        stream.write_batch(batch)
    path.write_bytes(path.read_bytes()[:-40])
    assert (
        refusal(RECORDING.load, path)
        == f"{path}: is the journal of a run that was killed or still goes on, with 3 whole"
        " samples; "
        f"`exoid recover {path}` makes a recording of it"
    )


def in_pieces(frame, *ends):
    """Cut a frame into tables, each from one row to the next of ``ends``."""
    cuts = [0, *ends, len(frame)]
    return [pa.Table.from_pandas(frame.iloc[a:b], preserve_index=False) for a, b in pairwise(cuts)]


def test_a_table_written_in_pieces_is_the_table_written_at_once(
    tmp_path, swinging_leg, run_metadata
):
    RECORDING.write(tmp_path / "whole.parquet", swinging_leg, run_metadata)
    RECORDING.write_pieces(
        tmp_path / "pieces.parquet", in_pieces(swinging_leg, 1, 1, 7), run_metadata
    )
    whole, pieces = (
        RECORDING.read(tmp_path / name) for name in ("whole.parquet", "pieces.parquet")
    )
    assert pieces.frame.equals(whole.frame)
    assert pieces.metadata == whole.metadata
    assert pq.read_schema(tmp_path / "pieces.parquet").equals(
        pq.read_schema(tmp_path / "whole.parquet"), True
    )


@pytest.mark.parametrize(
    ("column", "row", "value"),
    [
        ("time_s", 7, 0.0),
        ("time_s", 8, 0.0),
        ("hip_angle_rad", 8, np.nan),
        ("knee_angle_rad", 9, 30.0),
    ],
)
def test_what_is_refused_in_a_whole_table_is_refused_alike_in_pieces_and_leaves_nothing(
    tmp_path, swinging_leg, run_metadata, column, row, value
):
    path = tmp_path / "a.parquet"
    swinging_leg.loc[row, column] = value
    at_once = refusal(RECORDING.write, path, swinging_leg, run_metadata)
    assert f"row {row}: found" in at_once
    assert (
        refusal(RECORDING.write_pieces, path, in_pieces(swinging_leg, 7), run_metadata) == at_once
    )
    assert not list(tmp_path.iterdir())


def test_what_has_been_read_of_a_long_file_is_let_go(tmp_path, run_metadata):
    n, groups = 20_000, 40
    time = np.arange(n * groups) / 200.0
    piece = {
        f"{joint}_{q}": np.sin(time[:n])
        for joint in ("hip", "knee")
        for q in ("angle_rad", "torque_nm")
    }
    tables = (pa.table({"time_s": time[g * n : (g + 1) * n], **piece}) for g in range(groups))
    RECORDING.write_pieces(tmp_path / "long.parquet", tables, run_metadata)
    before, most, rows = pa.total_allocated_bytes(), 0, 0
    for table in RECORDING.scan(tmp_path / "long.parquet").pieces():
        rows, most = rows + table.num_rows, max(most, pa.total_allocated_bytes() - before)
    assert rows == n * groups
    assert most < 0.25 * 5 * 8 * rows  # five columns of eight bytes
