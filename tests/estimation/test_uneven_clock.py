"""A fit behind 5 Hz does not depend on how uneven the clock of a recording is."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.signal import butter, sosfiltfilt

from pipelines.contracts.table import Table
from pipelines.estimation.regression import regress
from pipelines.mechanics.even_grid import on_even_grid
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import Motion, Piece, motion_from_table
from pipelines.model import Model, baseline
from pipelines.settings.filter import FilterSettings

RATE_HZ = 600.0


@pytest.fixture(scope="module")
def logged() -> pd.DataFrame:
    """A pendulum under a loop whose samples are stamped late again and again.

    The stamps after a late one hurry, so that samples are sparse on one side of it and dense on the
    other. A late stamp makes an acceleration of one sign over few samples, and of the other over
    many.
    """
    rng = np.random.default_rng(3)
    taken = np.cumsum(np.full(7000, 1.0 / RATE_HZ) * rng.uniform(0.9, 1.1, 7000))
    w = 2.0 * np.pi * np.array([0.35, 0.8, 1.3])
    phase = np.outer(taken, w)
    q, dq = np.sin(phase) @ [0.7, 0.4, 0.1], np.cos(phase) * w @ [0.7, 0.4, 0.1]
    ddq = -np.sin(phase) * w**2 @ [0.7, 0.4, 0.1]
    torque = 0.05 * ddq + 0.3 * np.sin(q) + 0.05 * np.tanh(dq / 0.02) + 0.02 * dq
    late = np.maximum(0.0, 6e-3 - 0.8 / RATE_HZ * (np.arange(7000) % 40))
    stamps = taken + late
    return pd.DataFrame(
        {
            "time_s": stamps - stamps[0],
            "pivot_angle_rad": np.round(q * 4096 / np.pi) * np.pi / 4096,
            "pivot_torque_nm": torque + rng.normal(0.0, 0.02, 7000),
        }
    )


def motion_of(logged: pd.DataFrame) -> Motion:
    joints = [{"name": "pivot", "kind": "revolute"}]
    about = {"run": "exo_alone", "purpose": "train", "joints": joints, "sample_rate_hz": 600.0}
    return motion_from_table(motion_table(Table(logged, about), FilterSettings(cutoff_hz=38.0)))


def error_behind(motion: Motion, cutoff_hz: float) -> tuple[np.ndarray, float]:
    """Return parameters and residual, N·m rms, of rigid body and friction below a cut-off."""
    model = Model.of(baseline(motion.machine, ("exo_alone",)))
    r = regress(Piece(motion, slice(0, len(motion)), 0), model, cutoff_hz)
    x, y = r.regressor[r.scored][:, 0], r.torque[r.scored][:, 0]
    values = np.linalg.lstsq(x, y)[0]
    return values, float(np.sqrt(np.mean((y - x @ values) ** 2)))


def on_uniform_grid(logged: pd.DataFrame, cutoff_hz: float) -> tuple[np.ndarray, float]:
    """Return the same by least squares alone, on a uniform grid behind one low-pass."""
    time = np.arange(0.0, logged["time_s"].iloc[-1], 1.0 / RATE_HZ)
    sections = butter(4, cutoff_hz, fs=RATE_HZ, output="sos")
    q, torque = (
        sosfiltfilt(sections, np.interp(time, logged["time_s"], logged[name]))
        for name in ("pivot_angle_rad", "pivot_torque_nm")
    )
    dq = np.gradient(q, time)
    ddq = np.gradient(dq, time)
    x = np.column_stack([ddq, np.sin(q), np.sign(dq), dq])
    x[:, 2] = sosfiltfilt(sections, x[:, 2])
    moving = np.convolve(np.abs(dq) < 0.04, np.ones(97), "same") < 0.5
    moving[: int(0.5 * RATE_HZ)] = moving[-int(0.5 * RATE_HZ) :] = False
    x, torque = x[moving], torque[moving]
    values = np.linalg.lstsq(x, torque)[0]
    return values, float(np.sqrt(np.mean((torque - x @ values) ** 2)))


def test_the_error_behind_5_hz_is_that_of_least_squares_on_a_uniform_grid(logged):
    values, least = on_uniform_grid(logged, 5.0)
    motion = motion_of(logged)
    fitted, error = error_behind(on_even_grid(motion), 5.0)
    assert error == pytest.approx(least, rel=0.1)
    assert fitted[0] == pytest.approx(values[0], rel=0.01)
    # Means over samples are several times worse, so the clock is uneven enough to show it.
    assert error_behind(motion, 5.0)[1] > 3.0 * error


def test_cells_hold_the_means_over_time_of_straight_lines_and_none_spans_a_gap():
    time = np.concatenate([np.cumsum(np.tile([0.001, 0.004], 500)), 10.0 + 0.0025 * np.arange(999)])
    motion = Motion(
        time=time,
        q=np.sin(time)[:, np.newaxis],
        dq=np.zeros((len(time), 1)),
        ddq=np.zeros((len(time), 1)),
        torque=3.0 * time[:, np.newaxis],
        segment=(time > 5.0).astype(int),
        valid=np.ones(len(time), dtype=bool),
        sample_rate_hz=400.0,
        joints=("pivot",),
        metadata={"regression_filter": {"over_time": True}},
    )
    even = on_even_grid(motion)
    assert_allclose(even.torque[:, 0], 3.0 * even.time, rtol=1e-9)
    assert_allclose(even.dq[:, 0], np.cos(even.time), atol=1e-5)
    assert_allclose(even.ddq[5:-5, 0], -np.sin(even.time[5:-5]), atol=2e-2)
    steps = np.diff(even.time)
    assert np.sum(~np.isclose(steps, 1.0 / 400.0)) == 1
    assert not np.any((even.time > time[999]) & (even.time < 10.0))
    assert on_even_grid(even) is even
