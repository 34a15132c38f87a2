"""A clock that repeats, goes back, starts over, stops or wraps: reported and handled; nothing is
invented."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from exoid_cli.app import run
from pipelines.contracts import RECORDING
from tests.importing.conftest import MAP


def cut(columns, rows):
    return {name: values[rows] for name, values in columns.items()}


def joined(*parts):
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def test_irregular_samples_keep_their_instants(imported, pendulum, write_csv):
    jitter = np.random.default_rng(1).uniform(-0.001, 0.001, len(pendulum.time))
    columns = pendulum.columns() | {"time": pendulum.time + jitter}
    outcome = imported(write_csv(columns))
    table = outcome.recording()
    assert "irregular" in outcome.printed
    assert_allclose(table.frame["time_s"], columns["time"] - columns["time"][0], atol=1e-9)
    assert table.metadata["sample_rate_hz"] == pytest.approx(200.0, rel=1e-3)
    assert table.metadata["imported"]["irregular_share"] > 0.5
    assert table.metadata["gaps"] == []


def test_a_clock_in_whole_milliseconds_is_reported_but_has_no_gaps(imported, pendulum, write_csv):
    time = np.arange(2000) / 300.0
    columns = pendulum.columns() | {"time": np.round(1e3 * time).astype(int)}
    outcome = imported(write_csv(columns), map_text=MAP.replace('unit = "s"', 'unit = "ms"'))
    metadata = outcome.recording().metadata
    assert metadata["sample_rate_hz"] == pytest.approx(300.0, rel=1e-3)
    assert metadata["gaps"] == []


def test_lost_rows_become_gaps_and_are_not_filled_in(imported, pendulum, write_csv):
    kept = np.ones(2000, dtype=bool)
    kept[300:310] = kept[700] = False
    outcome = imported(write_csv(cut(pendulum.columns(), kept)))
    table = outcome.recording()
    assert len(table.frame) == 1989
    assert table.metadata["sample_rate_hz"] == pytest.approx(200.0)
    assert_allclose(table.metadata["gaps"], [[1.5, 10], [3.5, 1]])
    assert "2 gaps, 11 samples missing" in outcome.printed


def test_rows_without_a_number_become_gaps(imported, pendulum, write_csv):
    angle = pendulum.angle.astype(object)
    angle[100:103] = ""
    angle[500] = "ERR"
    velocity = pendulum.velocity.copy()
    velocity[900] = np.nan
    outcome = imported(write_csv(pendulum.columns() | {"angle": angle, "velocity": velocity}))
    table = outcome.recording()
    assert_allclose(table.metadata["gaps"], [[0.5, 3], [2.5, 1]])
    assert np.isnan(table.frame["pivot_velocity_rad_s"]).sum() == 1
    assert "'ERR' in row 500" in outcome.printed
    assert "no value in 4 rows; rows left out" in outcome.printed


def test_repeated_stamps_are_dropped_and_reported(imported, pendulum, write_csv):
    outcome = imported(
        write_csv(cut(pendulum.columns(), np.sort(np.append(np.arange(2000), [50, 50, 60]))))
    )
    assert len(outcome.recording().frame) == 2000
    assert (
        "3 rows (0.1%) with the stamp of another, the first is row 51; the first of each kept"
        in outcome.printed
    )


def test_rows_out_of_order_are_put_in_order(imported, pendulum, write_csv):
    order = np.arange(2000)
    order[[100, 101]] = order[[101, 100]]
    outcome = imported(write_csv(cut(pendulum.columns(), order)))
    assert_allclose(outcome.recording().frame["pivot_angle_rad"], pendulum.angle)
    assert "rows put in order" in outcome.printed


def test_a_clock_that_starts_over_keeps_the_longest_run(imported, pendulum, write_csv):
    columns = joined(cut(pendulum.columns(), slice(0, 600)), pendulum.columns())
    outcome = imported(write_csv(columns))
    frame = outcome.recording().frame
    assert_allclose(frame["time_s"], pendulum.time, atol=1e-9)
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle)
    assert "clock starts over at row 600, 2.995 s back" in outcome.printed
    assert "2 runs; rows 600-2599 kept, 600 left out" in outcome.printed


def test_many_restarts_of_a_clock_are_one_line(imported, pendulum, write_csv):
    columns = joined(*[cut(pendulum.columns(), slice(0, 300))] * 4, pendulum.columns())
    printed = imported(write_csv(columns)).printed
    assert "clock starts over 4 times, the first at row 300, 1.495 s back" in printed
    assert printed.count("starts over") == 1


def test_a_clock_that_starts_over_can_be_split_into_runs(imported, pendulum, write_csv):
    columns = joined(cut(pendulum.columns(), slice(0, 600)), pendulum.columns())
    outcome = imported(
        write_csv(columns), map_text=MAP.replace('unit = "s"', 'unit = "s"\nrestarts = "split"', 1)
    )
    assert len(outcome.recording("whole_run1").frame) == 600
    assert len(outcome.recording("whole_run2").frame) == 2000


def test_a_short_run_that_starts_over_is_not_mixed_with_the_next(imported, pendulum, write_csv):
    """Half a second back is no more than a late packet could be; a hundred rows of it are."""
    columns = joined(cut(pendulum.columns(), slice(0, 100)), pendulum.columns())
    assert_allclose(
        imported(write_csv(columns)).recording().frame["pivot_angle_rad"], pendulum.angle
    )


def test_a_first_sample_long_before_the_rest_is_left_out(imported, pendulum, write_csv):
    late = cut(pendulum.columns(), slice(1, None)) | {"time": pendulum.time[1:] + 1.0}
    outcome = imported(write_csv(joined(cut(pendulum.columns(), slice(0, 1)), late)))
    table = outcome.recording()
    assert "1 row 1 s before the rest; left out" in outcome.printed
    assert_allclose(table.frame["time_s"], pendulum.time[:-1], atol=1e-9)
    assert table.metadata["imported"]["began_s"] == pytest.approx(1.005)


def test_a_single_wild_stamp_is_left_out(imported, pendulum, write_csv):
    time = pendulum.time.copy()
    time[1000] = 4e9
    outcome = imported(write_csv(pendulum.columns() | {"time": time}))
    assert len(outcome.recording().frame) == 1999
    assert "1 stamp far from both neighbours, the first in row 1000; left out" in outcome.printed


@pytest.mark.parametrize(("bits", "unit", "scale"), [(16, "ms", 1e3), (32, "us", 1e6)])
def test_a_clock_that_was_full_is_reported_and_counted_on_where_the_map_says_so(
    imported, pendulum, write_csv, bits, unit, scale
):
    ticks = (
        np.round(pendulum.time * scale).astype(np.int64) + 2**bits - round(4 * scale)
    ) % 2**bits
    path = write_csv(pendulum.columns() | {"time": ticks})
    text = MAP.replace('unit = "s"', f'unit = "{unit}"', 1)
    silent = imported(path, map_text=text)
    assert f"set time.wraps_at = {2**bits}" in silent.printed
    outcome = imported(path, map_text=text.replace("[time]", f"[time]\nwraps_at = {2**bits}"))
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=1e-9)


def test_a_clock_that_begins_again_after_whole_hours_without_a_pause_was_full(
    imported, pendulum, write_csv
):
    path = write_csv(pendulum.columns() | {"time": (35996.0 + pendulum.time) % 36000.0})
    assert "set time.wraps_at = 36000" in imported(path).printed
    outcome = imported(path, map_text=MAP.replace("[time]", "[time]\nwraps_at = 36000", 1))
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=1e-9)


@pytest.mark.parametrize("kind", ["uint32", "uint64", "int32", "int64"])
def test_a_clock_of_any_width_that_starts_over_steps_back_and_does_not_wrap_round(
    imported, pendulum, tmp_path, kind
):
    """Stamps before the first one, as numbers without a sign, are 50 days later."""
    milliseconds = np.where(np.arange(2000) < 900, 100_000, 0) + np.round(1e3 * pendulum.time)
    milliseconds[[30, 31]] = milliseconds[[31, 30]]
    path = tmp_path / "log.parquet"
    pd.DataFrame(pendulum.columns() | {"time": milliseconds.astype(kind)}).to_parquet(path)
    outcome = imported(
        path, map_text=MAP.replace('unit = "s"', 'unit = "ms"\nrestarts = "split"', 1)
    )
    assert "goes back a little, 1 time" in outcome.printed
    lengths = sorted(len(RECORDING.read(file).frame) for file in outcome.folder.glob("*.parquet"))
    assert lengths == [900, 1100]


def test_a_stamp_that_no_clock_counts_to_is_refused(imported, pendulum, tmp_path):
    stamps = np.arange(2000, dtype=np.uint64) * np.uint64(5)
    stamps[7] = np.iinfo(np.uint64).max
    path = tmp_path / "log.parquet"
    pd.DataFrame(pendulum.columns() | {"time": stamps}).to_parquet(path)
    outcome = imported(path, map_text=MAP.replace('unit = "s"', 'unit = "ms"', 1))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "has the time stamp 18446744073709551615, too large for a clock" in outcome.err


def test_a_log_without_a_clock_is_uniform_where_the_map_says_so(imported, pendulum, write_csv):
    columns = pendulum.columns()
    del columns["time"]
    text = MAP.replace('column = "time"\nunit = "s"', "rate_hz = 200.0")
    outcome = imported(write_csv(columns), map_text=text)
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time)
    assert "no clock in the log" in outcome.printed


def test_a_channel_with_a_clock_of_its_own_is_interpolated(imported, pendulum, tmp_path):
    """Torque at 1 kHz, from its own clock, beside angles at 200 Hz: 0.05 N·m s² of bend make at
    most 10^-4 N·m."""
    import scipy.io

    fast = np.arange(0.5, 9.0, 0.001)
    path = tmp_path / "log.mat"
    torque = np.interp(fast, pendulum.time, pendulum.torque)
    scipy.io.savemat(path, pendulum.columns() | {"torque": torque, "fast": fast})
    without = imported(path)
    assert (without.code, "8500 rows where the clock has 2000" in without.err) == (2, True)
    text = MAP.replace('column = "torque"', 'column = "torque", time = "fast"')
    outcome = imported(path, map_text=text)
    frame = outcome.recording().frame
    inside = (pendulum.time >= 0.5) & (pendulum.time <= fast[-1])
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[inside], atol=1e-4)
    assert "sampled at 1000 Hz by a clock of its own (fast)" in outcome.printed
    uniform = imported(
        path, map_text=text.replace('column = "time"\nunit = "s"', "rate_hz = 200.0", 1)
    )
    assert (
        uniform.code,
        "joint[0].torque.time: found 'fast' with time.rate_hz" in uniform.err,
    ) == (2, True)


def test_a_channel_whose_clock_has_a_gap_before_its_last_row_keeps_that_row(
    imported, pendulum, write_csv
):
    torque = np.where(np.arange(2000) % 2, pendulum.torque, np.nan)
    torque[1900:1999] = np.nan
    path = write_csv(pendulum.columns() | {"torque": torque})
    text = MAP.replace('column = "torque"', 'column = "torque", time = "time"')
    frame = imported(path, map_text=text).recording().frame
    assert frame["time_s"].iloc[-1] == pendulum.time[-1]
    assert frame["pivot_torque_nm"].iloc[-1] == pytest.approx(pendulum.torque[-1])
    assert frame["time_s"].iloc[-2] == pendulum.time[1899]


def test_an_infinite_value_of_a_channel_that_is_not_needed_is_left_empty(
    imported, pendulum, write_csv
):
    velocity = pendulum.velocity.copy()
    velocity[[7, 9]] = np.inf
    outcome = imported(write_csv(pendulum.columns() | {"velocity": velocity}))
    assert (outcome.code, outcome.err) == (0, "")
    assert list(np.flatnonzero(outcome.recording().frame["pivot_velocity_rad_s"].isna())) == [7, 9]
    assert "no value in 2 rows; left empty" in outcome.printed


def test_rows_that_never_hold_both_need_to_be_interpolated(imported, pendulum, write_csv):
    """Two streams merged by time: each row has what one of them said."""
    torque = np.where(np.arange(2000) % 2, pendulum.torque, np.nan)
    angle = np.where(np.arange(2000) % 2, np.nan, pendulum.angle)
    path = write_csv(pendulum.columns() | {"torque": torque, "angle": angle})
    without = imported(path)
    assert without.code == 2
    assert "pivot_angle_rad in 50%, pivot_torque_nm in 50% of the rows" in without.err
    text = MAP.replace('column = "angle"', 'column = "angle", time = "time"')
    frame = imported(path, map_text=text).recording().frame
    assert len(frame) == 999  # not the last row: no angle follows it
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[1:-1:2], atol=1e-12)
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle[1:-1:2], atol=2e-4)


@pytest.mark.parametrize("seed", range(5))
def test_a_short_irregular_recording_can_be_filtered(imported, pendulum, write_csv, seed):
    """Its uniform grid has a place less than it has samples, or more."""
    jitter = np.random.default_rng(seed).uniform(-0.001, 0.001, 1200)
    columns = cut(pendulum.columns(), slice(0, 1200)) | {"time": pendulum.time[:1200] + jitter}
    outcome = imported(write_csv(columns))
    assert (
        run(
            [
                "-q",
                "filter",
                str(outcome.folder / "whole.parquet"),
                "-o",
                str(outcome.folder / "motion.parquet"),
            ]
        )
        == 0
    )


@pytest.mark.parametrize(("factor", "rate"), [(1e3, "0.2"), (1e-3, "2e+05")])
def test_a_unit_that_makes_no_machines_rate_is_reported(
    imported, pendulum, write_csv, factor, rate
):
    """Milliseconds taken for seconds, and seconds for milliseconds: imported as the map says, and
    reported."""
    outcome = imported(write_csv(pendulum.columns() | {"time": factor * pendulum.time}))
    assert outcome.code == 0
    assert f"time: {rate} Hz, usual are 10 to 10000 Hz; kept; check time.unit" in outcome.printed
    assert "check time.unit" not in imported(write_csv(pendulum.columns())).printed


def test_a_log_whose_rows_are_reversed_is_reported(imported, exoid, pendulum, write_csv):
    path = write_csv({name: values[::-1] for name, values in pendulum.columns().items()})
    outcome = imported(path)
    assert (
        outcome.code,
        "its clock runs backwards, by 9.995 s from the first row to the last" in outcome.err,
    ) == (
        2,
        True,
    )
    outcome = exoid("import", path, "--guess")
    assert (
        outcome.code,
        "its clock, 'time', runs backwards; reverse the order of its rows" in outcome.err,
    ) == (
        2,
        True,
    )


def test_dates_with_the_day_first_are_read_and_what_is_none_is_refused_by_what_it_says(
    imported, pendulum, write_csv
):
    stamps = pd.Timestamp("2024-03-05 23:59:58") + pd.to_timedelta(pendulum.time, unit="s")
    columns = pendulum.columns() | {"time": stamps.strftime("%d.%m.%Y %H:%M:%S,%f")}
    text = MAP.replace('unit = "s"', 'unit = "iso8601"', 1)
    outcome = imported(write_csv(columns, delimiter=";"), map_text=text)
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=1e-9)
    american = imported(
        write_csv(pendulum.columns() | {"time": stamps.strftime("%m/%d/%y %I.%M")}), map_text=text
    )
    assert (american.code, american.err.count("\n")) == (2, 1)
    assert "has '03/05/24 11.59', expected a date such as 2026-01-31" in american.err


@pytest.mark.parametrize(("unit", "seconds"), [("min", 60.0), ("d", 86400.0)])
def test_a_clock_that_starts_over_within_its_first_minute_or_day_has_its_fractions(
    imported, pendulum, write_csv, unit, seconds
):
    """Its whole part never changes, whatever its fractions do."""
    path = write_csv(pendulum.columns() | {"time": pendulum.time % 2.0 / seconds})
    outcome = imported(path, map_text=MAP.replace('unit = "s"', f'unit = "{unit}"', 1))
    assert outcome.code == 0
    assert "clock starts over" in outcome.printed


def test_fractions_without_leading_zeros_are_refused_as_that(imported, pendulum, write_csv):
    """As ``printf("%d.%d")`` writes seconds and microseconds."""
    microseconds = np.round(1e6 * pendulum.time).astype(int)
    stamps = [f"{t // 10**6}.{t % 10**6}" for t in microseconds]
    outcome = imported(write_csv(pendulum.columns() | {"time": stamps}))
    assert outcome.code == 2
    assert "without their leading zeros" in outcome.err and "time.rate_hz" in outcome.err


def time_code(frames, in_a_second, mark=":"):
    """Return hours, minutes, seconds and frames."""
    return [
        f"10:{k // (60 * in_a_second):02d}:{k // in_a_second % 60:02d}{mark}{k % in_a_second:02d}"
        for k in frames
    ]


@pytest.mark.parametrize(("in_a_second", "mark"), [(25, ":"), (30, ";"), (60, ".")])
def test_frames_of_a_time_code_are_no_hundredths_of_a_second(
    imported, pendulum, write_csv, in_a_second, mark
):
    """As cameras write them; several rows may have one frame."""
    dates = MAP.replace('unit = "s"', 'unit = "iso8601"', 1)
    for rows_a_frame in (1, 3):
        stamps = time_code(np.arange(2000) // rows_a_frame, in_a_second, mark)
        outcome = imported(write_csv(pendulum.columns() | {"time": stamps}), map_text=dates)
        assert outcome.code == 2
        assert f"count {in_a_second} frames" in outcome.err and "time.rate_hz" in outcome.err


@pytest.mark.parametrize("every", [1, 2, 5, 20])
def test_hundredths_of_a_second_are_no_frames(imported, pendulum, write_csv, every):
    """Also where rows are lost now and then."""
    dates = MAP.replace('unit = "s"', 'unit = "iso8601"', 1)
    hundredths = every * np.delete(np.arange(2001), 77)
    outcome = imported(
        write_csv(pendulum.columns() | {"time": time_code(hundredths, 100)}), map_text=dates
    )
    assert outcome.code == 0
    assert_allclose(outcome.recording().frame["time_s"], 0.01 * hundredths, atol=1e-9)


@pytest.mark.parametrize(
    ("clock", "is_named"),
    [
        (lambda time_s: {"Time 2 [s]": time_s[::4]}, True),
        (lambda time_s: {"Time 2 [s]": time_s[:500]}, False),
        (lambda time_s: {"Time 2 [ms]": 1e3 * time_s[:500]}, False),
        (lambda time_s: {"Time 2 [ms]": 1e3 * time_s[:500][::-1]}, False),
        (lambda time_s: {"Time 2 [s]": time_s[: 4 * 499 : 4]}, False),
    ],
    ids=["of its block", "the same", "in another unit", "backwards", "of other rows"],
)
def test_a_channel_that_ends_with_another_clock_is_named(
    imported, pendulum, write_csv, clock, is_named
):
    """A logger of two rates writes a block for each; the slower one ends far above."""
    columns = pendulum.columns()
    slow = clock(pendulum.time) | {"angle": columns.pop("angle")[::4]}
    del columns["velocity"]
    blank = {name: [*v, *[""] * (len(pendulum.time) - len(v))] for name, v in slow.items()}
    text = MAP.replace('velocity = { column = "velocity", unit = "rad/s" }\n', "")
    outcome = imported(write_csv(columns | blank), map_text=text)
    assert outcome.code == 0, outcome.err
    expected = f"rows of another clock, '{next(iter(slow))}'; read at the times of 'time'"
    assert (expected in outcome.printed) == is_named
    timed = text.replace('column = "angle"', f'column = "angle", time = "{next(iter(slow))}"')
    if is_named:
        outcome = imported(write_csv(columns | blank), map_text=timed)
        assert "of another clock" not in outcome.printed
        frame = outcome.recording().frame
        assert_allclose(frame["pivot_angle_rad"], pendulum.angle[: len(frame)], atol=1e-3)
