from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import MOTION
from pipelines.contracts.table import Table
from pipelines.errors import InputError
from pipelines.filtering import Summary, filtered
from pipelines.settings.filter import FilterSettings
from tests.filtering.recordings import W, grid, recording


@dataclass
class Filtered:
    """A motion whole, and what is said of it."""

    motion: Table
    segments: int
    cutoff_hz: float


def filter_recording(table, settings):
    motion = filtered(table, settings)
    summary = Summary(motion)
    pieces = list(summary.passing(motion.pieces()))
    return Filtered(
        Table(pa.concat_tables(pieces).to_pandas(), motion.metadata),
        summary.segments,
        summary.cutoff_hz,
    )


def test_velocity_and_acceleration_are_those_of_the_motion():
    time = grid(20)
    motion = filter_recording(recording(time, 1e-5), FilterSettings(cutoff_hz=12.0)).motion
    MOTION.check(motion.frame, motion.metadata)
    inside = motion.frame[motion.frame["valid"]]
    assert_allclose(
        inside["hip_velocity_rad_s"], 0.5 * W * np.cos(W * inside["time_s"] + 0.5), atol=2e-3
    )
    assert_allclose(
        inside["hip_acceleration_rad_s2"],
        -0.5 * W**2 * np.sin(W * inside["time_s"] + 0.5),
        atol=0.05,
    )


def test_torque_and_every_sample_stay_as_measured():
    original = recording(grid(20), 1e-5)
    frame = filter_recording(original, FilterSettings()).motion.frame
    assert len(frame) == len(original.frame)
    assert_allclose(frame["knee_torque_nm"], original.frame["knee_torque_nm"], rtol=0)
    assert_allclose(frame["knee_angle_measured_rad"], original.frame["knee_angle_rad"], rtol=0)
    assert_allclose(
        frame["knee_velocity_measured_rad_s"], original.frame["knee_velocity_rad_s"], rtol=0
    )


def test_a_gap_starts_a_new_segment_with_edges_of_its_own():
    time = grid(20)
    kept = np.r_[time[:2000], time[2100:]]
    found = filter_recording(recording(kept, 1e-5), FilterSettings(cutoff_hz=12.0))
    frame = found.motion.frame
    assert found.segments == 2
    assert list(frame["segment"].unique()) == [0, 1]
    # Before and after the gap as at the ends: not to be trusted.
    for edge in (0, 1999, 2000, len(frame) - 1):
        assert not frame["valid"].iloc[edge]
    inside = frame[frame["valid"]]
    assert_allclose(
        inside["hip_velocity_rad_s"], 0.5 * W * np.cos(W * inside["time_s"] + 0.5), atol=2e-3
    )


def test_a_jittering_clock_is_taken_at_its_own_times():
    rng = np.random.default_rng(3)
    time = np.sort(grid(20) + rng.uniform(-1e-3, 1e-3, 4000))
    frame = filter_recording(recording(time, 1e-6), FilterSettings(cutoff_hz=12.0)).motion.frame
    inside = frame[frame["valid"]]
    assert_allclose(
        inside["hip_velocity_rad_s"], 0.5 * W * np.cos(W * inside["time_s"] + 0.5), atol=3e-3
    )


@pytest.mark.parametrize("lasts_s", [19.9, 20.1, 20.3, 20.7])
def test_an_uneven_run_is_known_to_its_last_sample(lasts_s):
    rng = np.random.default_rng(3)
    time = np.linspace(0.0, lasts_s, 2000)
    time[1:-1] += rng.uniform(-4e-3, 4e-3, 1998)
    run = recording(time, 1e-6)
    run.metadata["sample_rate_hz"] = 1999 / lasts_s
    frame = filter_recording(run, FilterSettings(cutoff_hz=12.0)).motion.frame
    assert np.isfinite(frame["hip_velocity_rad_s"]).all()


def test_a_stretch_too_short_to_filter_is_kept_but_not_trusted():
    time = grid(20)
    kept = np.r_[time[:3000], time[3100:3103], time[3200:]]
    frame = filter_recording(recording(kept, 1e-5), FilterSettings(cutoff_hz=12.0)).motion.frame
    assert len(frame) == len(kept)
    assert not frame.loc[frame["segment"] == 1, "valid"].any()


def test_the_cutoff_and_why_stand_in_the_metadata():
    found = filter_recording(recording(grid(20), 1e-4), FilterSettings())
    said = found.motion.metadata["filter"]
    assert said["cutoff_hz"] == found.cutoff_hz
    assert "noise floor" in said["why"]
    assert found.motion.metadata["regression_filter"]["decimation"] == 5


@pytest.mark.parametrize(
    ("time", "settings", "metadata", "message"),
    [
        (
            grid(0.05),
            {},
            {},
            "the longest stretch without a gap has 10 samples, too few to choose a cut-off from",
        ),
        (
            grid(0.2),
            {"cutoff_hz": 5.0},
            {},
            (
                "no stretch without a gap lasts the 0.60 s that a 5.0 Hz filter needs; the longest"
                " has 40 samples"
            ),
        ),
        (
            grid(20) * 1e4,
            {},
            {"sample_rate_hz": 0.02, "imported": {"source": "log.csv"}},
            r"is sampled at 0.02 Hz, expected 12 Hz to 1 MHz, .*; correct time.unit in the map",
        ),
        (
            grid(20) * 1e-9,
            {},
            {"sample_rate_hz": 2e11},
            (
                r"is sampled at 2e\+11 Hz, expected 12 Hz to 1 MHz, .*; correct sample_rate_hz in"
                r" the rig file"
            ),
        ),
        (
            grid(20),
            {"cutoff_hz": 120.0},
            {},
            "filter.cutoff_hz is 120, expected less than half the sample rate of 200",
        ),
        (
            grid(20),
            {},
            {"sample_rate_hz": 1000.0},
            (
                r"metadata sample_rate_hz is 1000, but time_s advances by 0.005 s \(200 Hz\);"
                r" correct the one"
            ),
        ),
    ],
)
def test_what_cannot_be_filtered_is_refused_in_one_line(time, settings, metadata, message):
    with pytest.raises(InputError, match=message):
        filter_recording(recording(time, 1e-5, **metadata), FilterSettings(**settings))


def test_an_uneven_clock_whose_last_sample_rounds_to_the_next_grid_point_is_filtered():
    """Its last grid point is the least number that is later than the sample."""
    origin, rate_hz = 0.1, 200.0
    on_grid = origin + np.arange(3000) / rate_hz
    before = np.nextafter(on_grid, 0.0)
    rounded_up = ((before - origin) * rate_hz).astype(int) == np.arange(3000)
    count = int(np.flatnonzero(rounded_up)[-1]) + 1
    time = on_grid[:count].copy()
    time[100:-5:7] += 0.3 / rate_hz
    time[-1] = before[count - 1]
    motion = filter_recording(recording(time), FilterSettings(cutoff_hz=12.0)).motion
    assert np.isfinite(motion.frame["hip_acceleration_rad_s2"]).all()
