"""Clocks as devices have them, of any scale, rate and date; later stages agree with the import."""

import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.diagnosis.data_faults.timing import timing_faults
from pipelines.importing.quantities.numbers import whole_nanoseconds
from pipelines.importing.time.period import repeats_after
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from pipelines.signals.sampling import missing_samples, sample_rate, whole_periods
from tests.importing.conftest import MAP
from tests.importing.test_guess import guessed

__all__ = ["guessed"]


def with_clock(keys: str) -> str:
    return MAP.replace('unit = "s"', keys, 1)


def at(pendulum, time):
    """The pendulum's columns at other instants."""
    columns = {k: np.interp(time, pendulum.time, v) for k, v in pendulum.columns().items()}
    return columns | {"time": time}


@pytest.mark.parametrize("slow", [4, 8])
def test_no_later_stage_blames_a_rate_that_changes_on_the_way(imported, pendulum, write_csv, slow):
    kept = np.r_[0:800, 800:2000:slow]
    outcome = imported(write_csv(at(pendulum, pendulum.time[kept])))
    table = outcome.recording()
    assert f"rate changes between 200 and {200 // slow} Hz" in outcome.printed
    assert table.metadata["gaps"] == []
    assert table.metadata["sample_rate_hz"] == sample_rate(table.frame["time_s"].to_numpy())
    motion = motion_from_table(motion_table(table, FilterSettings()))
    assert motion.metadata["regression_filter"]["over_time"]
    # The slowest part limits the band.
    assert motion.cutoff_hz < 0.5 * 200 / slow
    assert list(timing_faults(replace(motion, file="a"))) == []


def test_steps_that_vary_are_no_change_of_rate_and_a_gap_lasts_as_long_as_its_stamps_say(
    imported, pendulum, write_csv
):
    """The gap is in a part that is slower than the run as a whole."""
    steps = np.random.default_rng(2).choice([0.003, 0.004, 0.006, 0.009], 1400)
    steps[1000:] = 0.007
    steps[1200] += 1.5
    time = np.cumsum(steps)
    outcome = imported(write_csv(at(pendulum, time[time < pendulum.time[-1]])))
    assert "rate changes" not in outcome.printed
    assert "the longest 1.5 s" in outcome.printed
    motion = motion_from_table(motion_table(outcome.recording(), FilterSettings()))
    (gap,) = [f for f in timing_faults(replace(motion, file="a")) if "gap" in f.what]
    assert "(1.50 s)" in gap.what


def test_the_rate_is_that_of_the_rows_that_are_kept(imported, pendulum, write_csv):
    """A second publisher of the same joint gives no torque, at half the rate."""
    other = at(pendulum, pendulum.time[::2] + 0.0015) | {"torque": np.full(1000, np.nan)}
    order = np.argsort(np.concatenate([pendulum.time, other["time"]]), kind="stable")
    both = {
        name: np.concatenate([values, other[name]])[order]
        for name, values in pendulum.columns().items()
    }
    metadata = imported(write_csv(both)).recording().metadata
    assert (metadata["sample_rate_hz"], metadata["gaps"]) == (200.0, [])


def test_a_late_stamp_and_a_change_of_rate_are_no_missing_samples_and_pauses_are():
    time = np.concatenate([np.arange(400) * 0.0025, 1.0 + np.arange(200) * 0.02])
    time[100] += 0.002
    assert not missing_samples(time).any()
    paused = time + 1.0 * (np.arange(600) >= 300)
    assert np.flatnonzero(missing_samples(paused)).tolist() == [299]
    assert missing_samples(paused)[299] == 400


@pytest.mark.parametrize(("samples", "whole"), [(2401, 2), (2400, 2), (2399, 2), (2398, 1)])
def test_of_two_periods_the_last_may_lack_a_sample(samples, whole):
    assert whole_periods((samples - 1) * 0.01, 0.01, 12.0) == whole
    time = np.arange(samples) * 0.01
    motion = np.sin(2 * np.pi / 12 * time) + 0.1 * np.sin(6 * np.pi / 12 * time)
    if whole == 2:
        assert repeats_after(time, motion[:, np.newaxis]) == pytest.approx(12.0, rel=1e-4)


@pytest.mark.parametrize(
    ("keys", "count_s", "start"),
    [
        ('unit = "100ns"', 1e-7, 133_000_000_000_000_000),
        ('unit = "ms"\nscale = 0.1', 1e-4, 0),
        ('unit = "d"', 86400.0, 738_000),
        ('unit = "h"', 3600.0, 7.0),
        ('unit = "s"\nscale = 3.0517578125e-05', 2.0**-15, 0),
    ],
)
def test_a_clock_of_any_scale_gives_seconds(imported, pendulum, write_csv, keys, count_s, start):
    counts = pendulum.time / count_s
    stamps = counts + start if count_s > 1.0 else np.rint(counts).astype(np.int64) + int(start)
    outcome = imported(write_csv(pendulum.columns() | {"time": stamps}), map_text=with_clock(keys))
    # Days since the year 0 have a resolution of 10 microseconds in float64.
    atol = 1.1e-5 if start == 738_000 else max(count_s if count_s < 1.0 else 1e-9, 1e-9)
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=atol)


def test_seconds_and_nanoseconds_in_two_columns_are_one_clock(imported, pendulum, write_csv):
    nanoseconds = np.rint(1e9 * pendulum.time).astype(np.int64)
    columns = {"sec": 1_770_000_000 + nanoseconds // 10**9, "nsec": nanoseconds % 10**9}
    path = write_csv(columns | pendulum.columns() | {"time": np.zeros(2000)})
    text = MAP.replace('column = "time"', 'column = "sec"\nplus = "nsec"', 1)
    assert_allclose(
        imported(path, map_text=text).recording().frame["time_s"], pendulum.time, atol=1e-9
    )


def test_ticks_within_a_second_are_added_to_the_seconds(imported, pendulum, write_csv):
    ticks = np.rint(1e4 * pendulum.time).astype(np.int64)
    columns = {"sec": 4812 + ticks // 10**4, "time": ticks % 10**4}
    text = with_clock('unit = "ms"\nscale = 0.1\nplus = "sec"\nplus_unit = "s"')
    outcome = imported(write_csv(pendulum.columns() | columns), map_text=text)
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=1e-9)


def test_a_date_and_its_time_of_day_in_two_columns_are_one_clock(imported, pendulum, write_csv):
    stamps = pd.Timestamp("2026-03-04 23:59:57") + pd.to_timedelta(pendulum.time, unit="s")
    columns = {"day": stamps.strftime("%d.%m.%Y"), "time": stamps.strftime("%H:%M:%S.%f")}
    text = with_clock('unit = "iso8601"\nplus = "time"').replace('"time"', '"day"', 1)
    outcome = imported(write_csv(pendulum.columns() | columns), map_text=text)
    assert_allclose(outcome.recording().frame["time_s"], pendulum.time, atol=1e-9)


def test_a_time_of_day_and_its_milliseconds_in_two_columns_are_one_clock(
    imported, pendulum, write_csv
):
    """As FactoryTalk writes them; the unit of the second column must be given."""
    stamps = pd.Timestamp("2026-03-04 23:59:57") + pd.to_timedelta(pendulum.time, unit="s")
    columns = {"time": stamps.strftime("%H:%M:%S"), "milli": stamps.microsecond // 1000}
    path = write_csv(pendulum.columns() | columns)
    without = imported(path, map_text=with_clock('unit = "iso8601"\nplus = "milli"'))
    assert without.code == 2 and "time.plus_unit" in without.err
    text = with_clock('unit = "iso8601"\nplus = "milli"\nplus_unit = "ms"')
    frame = imported(path, map_text=text).recording().frame
    assert_allclose(frame["time_s"], pendulum.time, atol=1e-9)


@pytest.mark.parametrize(
    ("one", "other", "step_s"),
    [
        ("01/31/2026 11:59:59.995 AM", "01/31/2026 12:00:00.000 PM", 0.005),
        ("03/04/2026 23:59:59.99", "04/04/2026 00:00:00.00", 0.01),
        ("03/04/2026 23:59:59.99", "03/05/2026 00:00:00.00", 0.01),
        ("3/4/26 1:00:00 pm", "3/4/26 1:00:01 p.m.", 1.0),
        ("12:00:00:125", "12:00:00:130", 0.005),
        ("2026-01-31 12:00:00.5 UTC", "2026-01-31 13:00:01.0+01:00", 0.5),
        ("1.2.2026 23:59:59", "2.2.2026 0:00:01", 2.0),
    ],
)
def test_dates_in_other_words_differ_by_what_passed(one, other, step_s):
    assert np.diff(whole_nanoseconds(np.array([one, other], dtype=object)))[0] == step_s * 1e9


def test_a_day_that_may_be_a_month_is_no_date_unless_the_map_says_how_it_is_written(
    imported, pendulum, write_csv
):
    hours = pd.to_timedelta(np.where(np.arange(2000) < 1000, 0.0, 48.0), unit="h")
    stamps = pd.Timestamp("2026-03-04") + pd.to_timedelta(pendulum.time, unit="s") + hours
    path = write_csv(pendulum.columns() | {"time": stamps.strftime("%d/%m/%Y %H:%M:%S.%f")})
    outcome = imported(path, map_text=with_clock('unit = "iso8601"'))
    assert (outcome.code, "exchanged, set time.format" in outcome.err) == (2, True)
    text = with_clock('unit = "iso8601"\nformat = "%d/%m/%Y %H:%M:%S.%f"')
    assert imported(path, map_text=text).code == 0


@pytest.mark.parametrize("written", [True, False])
def test_a_clock_of_the_day_goes_on_after_midnight(imported, pendulum, write_csv, written):
    since = 86395.0 + pendulum.time
    stamps = pd.Timestamp("1970-01-01") + pd.to_timedelta(since, unit="s")
    time = stamps.strftime("%H:%M:%S.%f") if written else np.round(since % 86400.0, 6)
    path = write_csv(pendulum.columns() | {"time": time})
    unit = "iso8601" if written else "s"
    if not written:
        assert "set time.wraps_at = 86400" in imported(path).printed
    keys = f'unit = "{unit}"' + ("" if written else "\nwraps_at = 86400")
    frame = imported(path, map_text=with_clock(keys)).recording().frame
    assert_allclose(frame["time_s"], pendulum.time, atol=1e-9)


@pytest.mark.parametrize(
    ("begin", "hours", "form", "cause"),
    [
        ("1970-01-01 12:59:57", 12, "%I:%M:%S.%f", "as a 12-hour clock without AM and PM"),
        ("2026-10-25 02:59:57", 1, "%Y-%m-%d %H:%M:%S.%f", "as at the end of summer time"),
    ],
)
def test_a_written_clock_set_back_by_hours_names_the_cause_and_what_counts_it_on(
    imported, pendulum, write_csv, begin, hours, form, cause
):
    back = pd.to_timedelta(np.where(pendulum.time < 3.0, 0, hours), unit="h")
    stamps = pd.Timestamp(begin) + pd.to_timedelta(pendulum.time, unit="s") - back
    path = write_csv(pendulum.columns() | {"time": stamps.strftime(form)})
    text = with_clock('unit = "iso8601"')
    remedy = f"wraps_at = {hours * 3600 * 10**9}"
    assert f"{cause}: if that is so, set time.{remedy}" in imported(path, map_text=text).printed
    frame = imported(path, map_text=with_clock(f'unit = "iso8601"\n{remedy}')).recording().frame
    assert_allclose(frame["time_s"], pendulum.time, atol=1e-9)


def test_minutes_and_seconds_are_a_clock_that_starts_over_after_an_hour(
    imported, guessed, pendulum, write_csv
):
    since = (3595.0 + pendulum.time) % 3600.0
    written = [f"{int(s // 60):02d}:{s % 60:06.3f}" for s in np.round(since, 3)]
    path = write_csv(pendulum.columns() | {"time": written})
    text, doubts = guessed(path)
    hour_ns = 3_600_000_000_000
    assert (
        f"time.wraps_at = {hour_ns}"
        in imported(path, map_text=re.sub("wraps_at.*", "", text)).printed
    )
    assert tomllib.loads(text)["time"]["wraps_at"] == hour_ns and "time.wraps_at" in doubts
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "per_unit_s", "unit"),
    [
        ("Time [d]", 86400.0, "d"),
        ("time_days", 86400.0, "d"),
        ("Time [h]", 3600.0, "h"),
        ("time", 86400.0, "d"),
    ],
)
def test_a_clock_in_days_or_hours_with_decimals_is_proposed(
    imported, guessed, pendulum, write_csv, name, per_unit_s, unit
):
    columns = {name: 0.4 + pendulum.time / per_unit_s, "angle_rad": pendulum.angle}
    path = write_csv(columns | {"torque_Nm": pendulum.torque})
    text, doubts = guessed(path)
    assert tomllib.loads(text)["time"] == {"column": name, "unit": unit}
    assert ("time.unit" in doubts) == (name == "time")
    frame = imported(path, map_text=text).recording("log_train").frame
    assert_allclose(frame["time_s"], pendulum.time[: len(frame)], atol=1e-6)


OWN = MAP.replace('column = "torque"', 'column = "torque", time = "own"')


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        ([""] * 2000, "joint[0].torque.time: 'own' has no time stamp in any row"),
        (["none"] * 2000, "joint[0].torque.time: 'own' has no time stamp in any row"),
        ([3.0] * 2000, "joint[0].torque.time: 'own' has the same time stamp in every row"),
        (np.arange(2000) * 5.0 + 60_000, "runs from 60000 to 69995 s, the log from 0 to 9.995 s"),
    ],
)
def test_a_channels_clock_that_is_none_is_refused_by_name(
    imported, pendulum, write_csv, stamps, message
):
    outcome = imported(write_csv(pendulum.columns() | {"own": stamps}), map_text=OWN)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert message in outcome.err


def test_a_channels_clock_may_have_another_unit_and_another_zero(imported, pendulum, write_csv):
    late = pendulum.time + 0.0021
    columns = pendulum.columns() | {
        "own": np.rint(1e6 * (late - 0.5)).astype(int),
        "torque": np.interp(late, pendulum.time, pendulum.torque),
    }
    text = OWN.replace('time = "own"', 'time = "own", time_unit = "us", time_offset_s = 0.5')
    frame = imported(write_csv(columns), map_text=text).recording().frame
    rows = np.searchsorted(pendulum.time, frame["time_s"].iloc[:-1])
    # Straight lines cut the corners of Coulomb friction only.
    assert np.median(np.abs(frame["pivot_torque_nm"].iloc[:-1] - pendulum.torque[rows])) < 1e-4


def held(pendulum, every):
    row = np.arange(2000) // every * every
    return pendulum.columns() | {"angle": pendulum.angle[row], "torque": pendulum.torque[row]}


def test_rows_faster_than_the_bus_are_reported_and_thinned_where_the_map_says_so(
    imported, pendulum, write_csv
):
    path = write_csv(held(pendulum, 4))
    assert "new values at 50 Hz in rows at 200 Hz" in imported(path).printed
    outcome = imported(path, map_text=with_clock('unit = "s"\nkeep = "new"'))
    frame = outcome.recording().frame
    assert "1500 rows that repeat pivot_angle_rad, pivot_torque_nm left out" in outcome.printed
    assert_allclose(frame["time_s"], pendulum.time[::4], atol=1e-9)
    assert_allclose(frame["pivot_torque_nm"], pendulum.torque[::4], atol=1e-12)


def test_an_angle_that_comes_at_other_instants_than_the_torque_is_interpolated(
    imported, pendulum, write_csv
):
    row = np.maximum((np.arange(2000) - 2) // 4 * 4 + 2, 0)
    path = write_csv(held(pendulum, 4) | {"angle": pendulum.angle[row]})
    outcome = imported(path, map_text=with_clock('unit = "s"\nkeep = "new"'))
    frame = outcome.recording().frame
    began_s = outcome.recording().metadata["imported"]["began_s"]
    at = np.rint((frame["time_s"] + began_s) * 200).astype(int)
    assert_allclose(frame["pivot_angle_rad"], pendulum.angle[at], atol=1e-3)


def test_a_coarse_reading_that_repeats_is_not_held(imported, pendulum, write_csv):
    rounded = {name: np.round(getattr(pendulum, name), 2) for name in ("angle", "torque")}
    assert "new values" not in imported(write_csv(pendulum.columns() | rounded)).printed


def test_rows_without_a_value_repeat_nothing(imported, pendulum, write_csv):
    torque = np.where(np.arange(2000) % 3, np.nan, pendulum.torque)
    printed = imported(write_csv(pendulum.columns() | {"torque": torque})).printed
    assert "rows left out" in printed and "new values" not in printed


@pytest.mark.parametrize(
    ("stamps", "expected", "sure"),
    [
        (lambda t: 133_000_000_000_000_000 + np.rint(1e7 * t).astype(int), {"unit": "100ns"}, True),
        (lambda t: 738_000 + t / 86400.0, {"unit": "d"}, True),
        (lambda t: np.rint(1e4 * t).astype(int), {"unit": "ms", "scale": 0.1}, False),
        (lambda t: np.rint(1e5 * t).astype(int), {"unit": "us", "scale": 10.0}, False),
    ],
)
def test_a_unit_of_time_is_sure_by_a_date_and_otherwise_follows_from_the_motion(
    exoid, pendulum, write_csv, tmp_path, stamps, expected, sure
):
    path = write_csv(pendulum.columns() | {"time": stamps(pendulum.time)})
    outcome = exoid("--json", "import", path, "--guess", "--map", tmp_path / "guess.toml")
    keys = {doubt["key"] for doubt in json.loads(outcome.out)["doubts"]}
    time = tomllib.loads((tmp_path / "guess.toml").read_text(encoding="utf-8"))["time"]
    assert time == {"column": "time"} | expected
    assert ("time.unit" not in keys) == sure


def test_a_tick_that_nothing_shows_is_unsure(exoid, pendulum, write_csv, tmp_path):
    columns = pendulum.columns() | {"time": np.arange(2000) * 7}
    del columns["velocity"]
    outcome = exoid(
        "--json", "import", write_csv(columns), "--guess", "--map", tmp_path / "guess.toml"
    )
    assert "time.unit" in {doubt["key"] for doubt in json.loads(outcome.out)["doubts"]}


def test_a_second_clock_that_drifts_makes_the_first_unsure(exoid, pendulum, write_csv, tmp_path):
    columns = pendulum.columns() | {"host time [s]": pendulum.time * (1.0 + 1e-3)}
    outcome = exoid(
        "--json", "import", write_csv(columns), "--guess", "--map", tmp_path / "guess.toml"
    )
    assert "time.column" in {doubt["key"] for doubt in json.loads(outcome.out)["doubts"]}
