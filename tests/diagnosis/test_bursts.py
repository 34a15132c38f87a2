"""Bursts are separated from noise of any colour and changing size, from pushes, and from what
repeats."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.evidence.bursts import bursts
from pipelines.signals.blocks import BlockAverage

WIDTH_S, PERIOD_S = 0.025, 10.0
TIME = np.arange(0.0, 40.0, WIDTH_S)
ENOUGH = 5.0
"""Log Bayes factor that outweighs the prior odds of an unlisted law."""


@dataclass
class Recorded:
    """The parts of a run that the evidence reads, drives first."""

    time: np.ndarray
    usable: np.ndarray
    motion: SimpleNamespace
    has_cuffs: bool
    block: BlockAverage


def recorded(
    residual: np.ndarray,
    kind: str = "exo_alone",
    period_s: float | None = PERIOD_S,
    joints: int = 1,
) -> Recorded:
    """Return a run whose NaN are not usable."""
    names = ("hip", "knee")[:joints]
    motion = SimpleNamespace(sample_rate_hz=200.0, period_s=period_s, joints=names, run=kind)
    time = np.arange(len(residual)) * WIDTH_S
    has_cuffs = residual.shape[1] == 2 * joints
    return Recorded(time, np.isfinite(residual), motion, has_cuffs, BlockAverage(5))


def evidence(*residuals: np.ndarray, kinds: Sequence[str] = (), **options) -> float:
    """Return the evidence of bursts in runs of one joint, (m,) or (m, 2) with cuffs."""
    columns = [r.reshape(len(r), -1) for r in residuals]
    kinds = kinds or ["exo_alone"] * len(columns)
    runs = [recorded(r, kind, **options) for r, kind in zip(columns, kinds, strict=True)]
    return float(bursts(runs, columns)[0])


def coloured(rng: np.random.Generator, tau_s: float = 0.05, time: np.ndarray = TIME) -> np.ndarray:
    """Return first-order noise of rms one."""
    memory = np.exp(-WIDTH_S / tau_s) if tau_s else 0.0
    white = rng.normal(size=len(time)) * np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], white, zi=[memory * rng.normal()])[0]


def knocks(
    rng: np.random.Generator, each_s: float = 1.2, fade_s: float = 0.3, time: np.ndarray = TIME
) -> np.ndarray:
    """Return knocks at random times, of either sign, of size one."""
    torque = np.zeros(len(time))
    for start in np.cumsum(rng.exponential(each_s, int(2.0 * time[-1] / each_s))):
        since = time - start
        torque += np.where(since >= 0.0, rng.normal() * np.exp(-np.abs(since) / fade_s), 0.0)
    return torque


@pytest.mark.parametrize(
    ("tau_s", "louder"),
    [
        pytest.param(
            tau_s,
            louder,
            marks=()
            if (tau_s, louder) in ((0.0, 1.0), (0.05, 3.0), (2.0, 3.0))
            else pytest.mark.slow,
        )
        for tau_s in (0.0, 0.05, 0.25, 2.0)
        for louder in (1.0, 3.0)
    ],
)
def test_noise_of_any_colour_and_of_a_size_that_follows_the_speed_is_hardly_ever_bursts(
    tau_s, louder
):
    rng = np.random.default_rng(1)
    size = 1.0 + (louder - 1.0) * (0.5 + 0.5 * np.sin(2.0 * np.pi * TIME / PERIOD_S))
    found = [
        evidence(size * coloured(rng, tau_s), size * coloured(rng, tau_s)) > ENOUGH
        for _ in range(50)
    ]
    assert np.mean(found) <= 0.02


def test_a_loud_run_next_to_quiet_ones_has_no_bursts():
    rng = np.random.default_rng(5)
    found = [
        evidence(*(size * coloured(rng) for size in (1.0, 1.0, 1.0, 1.0, 6.0))) > ENOUGH
        for _ in range(20)
    ]
    assert not any(found)


@pytest.mark.parametrize("fade_s", [0.1, 0.3])
@pytest.mark.parametrize("each_s", [1.2, 4.0])
def test_knocks_above_the_noise_are_bursts(fade_s, each_s):
    rng = np.random.default_rng(2)
    found = [
        evidence(*(4.0 * knocks(rng, each_s, fade_s) + 0.3 * coloured(rng) for _ in range(2)))
        for _ in range(20)
    ]
    assert np.mean(np.array(found) > ENOUGH) >= 0.9


def test_two_knocks_a_minute_are_enough_in_ten_minutes():
    rng, time = np.random.default_rng(6), np.arange(0.0, 600.0, WIDTH_S)
    torque = 8.0 * knocks(rng, 30.0, 0.3, time) + 0.3 * coloured(rng, time=time)
    assert evidence(torque) > ENOUGH


def test_gaps_and_a_period_of_no_whole_number_of_blocks_hide_none_and_make_none():
    rng = np.random.default_rng(7)
    gaps = (TIME % 7.0) < 0.5
    for torque, found in ((4.0 * knocks(rng), True), (np.zeros(len(TIME)), False)):
        holed = np.where(gaps, np.nan, torque + 0.3 * coloured(rng))
        for period_s in (PERIOD_S, 9.97):
            assert (evidence(holed, period_s=period_s) > ENOUGH) == found


def test_knocks_that_repeat_with_the_motion_are_no_bursts():
    rng = np.random.default_rng(3)
    one = 4.0 * knocks(rng)[TIME < PERIOD_S - 1e-9]
    assert evidence(np.tile(one, 4) + 0.3 * coloured(rng)) < 0.0


def test_what_a_wearer_pushes_through_the_cuffs_is_no_burst_and_a_knock_on_the_machine_is():
    rng = np.random.default_rng(8)
    push, noise = 4.0 * knocks(rng), 0.3 * coloured(rng)
    with_cuffs = np.column_stack([push + noise, push + 0.3 * coloured(rng)])
    assert evidence(with_cuffs, kinds=["with_human"]) < ENOUGH
    on_machine = np.column_stack([push + noise, 0.3 * coloured(rng)])
    assert evidence(on_machine, kinds=["with_human"]) > ENOUGH
    assert evidence(push + noise, kinds=["with_human"]) == 0.0, "nobody can say who pushed"


def test_each_joint_has_evidence_of_its_own():
    rng = np.random.default_rng(9)
    residual = np.column_stack([0.3 * coloured(rng), 4.0 * knocks(rng) + 0.3 * coloured(rng)])
    hip, knee = bursts([recorded(residual, joints=2)], [residual])
    assert hip < ENOUGH < knee


def test_without_periods_or_with_few_samples_there_is_no_evidence():
    rng = np.random.default_rng(4)
    torque = 4.0 * knocks(rng)
    assert evidence(torque, period_s=None) == 0.0
    assert evidence(torque[: len(TIME) // 4], period_s=4.0) == 0.0
    assert evidence(np.zeros(len(TIME))) == 0.0
