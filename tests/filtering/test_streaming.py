"""A recording that is filtered window by window is filtered as if all at once, whatever its length
and its gaps."""

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline

from pipelines.contracts import RECORDING, parquet
from pipelines.contracts.windows import windows
from pipelines.filtering import filtered
from pipelines.mechanics import kinematics
from pipelines.mechanics.stretches import find_stretches
from pipelines.settings.filter import FilterSettings
from pipelines.signals.low_pass import derivative, low_pass
from tests.filtering.recordings import RATE_HZ, grid, recording

ROUNDING = 1e-13
"""Of the largest angle: what a recursion whose poles are near 1 makes of the last digit. A
difference of angles between samples multiplies it by the sample rate."""


def rounding(column, largest_angle):
    times = {"velocity": RATE_HZ, "acceleration": RATE_HZ**2}
    return ROUNDING * largest_angle * next((t for name, t in times.items() if name in column), 1.0)


def in_small_pieces(monkeypatch, rows):
    monkeypatch.setattr(parquet, "ROWS", rows)
    monkeypatch.setattr(kinematics, "WINDOW", rows)


def whole(path, settings):
    return pa.concat_tables(filtered(RECORDING.scan(path), settings).pieces()).to_pandas()


def holed(jitter_s=0.0):
    """A minute with gaps: a long stretch, two of a few samples, one too short to filter, the
    rest."""
    time = grid(60)
    time = np.sort(time + np.random.default_rng(1).uniform(-jitter_s, jitter_s, len(time)))
    return np.r_[time[:5003], time[5100:5103], time[5200:5290], time[5400:5412], time[5500:]]


@pytest.fixture
def stored(tmp_path):
    def store(time):
        path = tmp_path / "run.parquet"
        table = recording(time, 1e-4)
        RECORDING.write(path, table.frame, table.metadata)
        return path

    return store


@pytest.mark.parametrize(
    "settings", [{}, {"cutoff_hz": 2.0}, {"cutoff_hz": 60.0, "order": 1}, {"order": 9}]
)
@pytest.mark.parametrize("jitter_s", [0.0, 1e-3])
def test_windows_change_nothing_but_rounding(stored, monkeypatch, settings, jitter_s):
    path, chosen = stored(holed(jitter_s)), FilterSettings(**settings)
    at_once = whole(path, chosen)
    in_small_pieces(monkeypatch, 700)
    in_windows = whole(path, chosen)
    assert list(in_windows.columns) == list(at_once.columns)
    for name in at_once.columns:
        if name in ("segment", "valid"):
            assert_array_equal(in_windows[name], at_once[name])
        else:
            assert_allclose(in_windows[name], at_once[name], rtol=0, atol=rounding(name, 0.7))


def test_a_window_as_long_as_the_recording_is_the_textbook_filter(stored):
    """Forwards and backwards over all samples, straight from SciPy: what windows are to agree
    with."""
    time = grid(20)
    frame = whole(stored(time), FilterSettings(cutoff_hz=9.0))
    smooth = low_pass(frame["hip_angle_measured_rad"].to_numpy(), RATE_HZ, 9.0)
    assert_array_equal(frame["hip_angle_rad"], smooth)
    assert_array_equal(frame["hip_acceleration_rad_s2"], derivative(smooth, RATE_HZ, 2))


def test_a_clock_that_is_not_the_nominal_one_is_followed_over_hours_as_over_seconds(
    stored, monkeypatch
):
    """30 ppm fast: after minutes no sample stands on the nominal grid any more."""
    in_small_pieces(monkeypatch, 5000)
    time = grid(400) * (1 + 3e-5)
    frame = whole(stored(time), FilterSettings(cutoff_hz=12.0))
    uniform = np.arange(int((time[-1] - time[0]) * RATE_HZ) + 1) / RATE_HZ
    on_grid = low_pass(CubicSpline(time, frame["knee_angle_measured_rad"])(uniform), RATE_HZ, 12.0)
    expected = CubicSpline(uniform, derivative(on_grid, RATE_HZ, 1))(time)
    assert_allclose(frame["knee_velocity_rad_s"], expected, rtol=0, atol=rounding("velocity", 0.7))


@pytest.mark.parametrize("rows", [1, 7, 1000, 20000])
def test_stretches_do_not_depend_on_the_pieces_they_come_in(rows):
    time = holed(jitter_s=5e-5)
    found = find_stretches((time[i : i + rows] for i in range(0, len(time), rows)), RATE_HZ)
    assert_array_equal(found.samples, [5003, 3, 90, 12, 6500])
    assert_array_equal(found.origin_s, time[[0, 5003, 5006, 5096, 5108]])
    assert_array_equal(found.uniform, find_stretches([time], RATE_HZ).uniform)
    assert found.uniform[1:4].all()
    assert not find_stretches([holed(jitter_s=1e-3)], RATE_HZ).uniform[0]


@pytest.mark.parametrize("piece", [1, 3, 10, 100])
@pytest.mark.parametrize(("length", "margin"), [(10, 3), (4, 9), (100, 5), (7, 0)])
def test_the_cores_of_windows_are_all_rows_once_and_in_order(piece, length, margin):
    rows = pa.table({"row": np.arange(53)})
    seen = []
    for window in windows([rows.slice(i, piece) for i in range(0, 53, piece)], length, margin):
        numbers = window.rows["row"].to_numpy()
        core = numbers[window.core]
        assert numbers[0] == window.first == max(0, core[0] - margin)
        assert numbers[-1] >= min(52, core[-1] + margin)
        seen += list(core)
    assert seen == list(range(53))


def test_a_fault_deep_in_a_file_is_named_by_its_row(stored, monkeypatch):
    time = grid(20)
    time[3500] = time[3499]
    table = recording(grid(20))
    table.frame["time_s"] = time
    path = stored(grid(20))
    monkeypatch.setattr(parquet, "ROWS", 500)
    parquet.save(
        path, [pa.Table.from_pandas(table.frame)], {**table.metadata, "contract": "recording/1"}
    )
    with pytest.raises(Exception, match=r"column time_s, row 3500: found 17\.495 after 17\.495"):
        RECORDING.read(path)
