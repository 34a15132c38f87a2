"""Bursts are told from noise of any colour and of a changing size, and from what repeats."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.evidence.bursts import bursts
from pipelines.signals.blocks import BlockAverage

WIDTH_S, PERIOD_S = 0.025, 10.0
TIME = np.arange(0.0, 40.0, WIDTH_S)
TELLS = 5.0
"""Log Bayes factor that outweighs the prior odds of an unlisted law."""


@dataclass
class Recorded:
    """What the evidence reads of a run of one joint."""

    time: np.ndarray
    usable: np.ndarray
    block: BlockAverage
    motion: SimpleNamespace


def evidence(*residuals: np.ndarray, period_s: float | None = PERIOD_S) -> float:
    """Return the evidence of bursts in runs' residuals."""
    motion = SimpleNamespace(sample_rate_hz=200.0, period_s=period_s, joints=("knee",))
    usable = np.ones((len(TIME), 1), bool)
    runs = [Recorded(TIME, usable, BlockAverage(5), motion) for _ in residuals]
    return float(bursts(runs, [r[:, np.newaxis] for r in residuals])[0])


def coloured(rng: np.random.Generator, tau_s: float) -> np.ndarray:
    """Return first-order noise of rms one."""
    memory = np.exp(-WIDTH_S / tau_s) if tau_s else 0.0
    white = rng.normal(size=len(TIME)) * np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], white, zi=[memory * rng.normal()])[0]


def knocks(rng: np.random.Generator, each_s: float, fade_s: float) -> np.ndarray:
    """Return knocks at moments of their own, of either sign, of rms one."""
    torque = np.zeros(len(TIME))
    for start in np.cumsum(rng.exponential(each_s, int(60.0 / each_s))):
        since = TIME - start
        torque += np.where(since >= 0.0, rng.normal() * np.exp(-np.abs(since) / fade_s), 0.0)
    return torque / np.sqrt(np.mean(torque**2))


@pytest.mark.parametrize("tau_s", [0.0, 0.05, 0.25, 2.0])
@pytest.mark.parametrize("louder", [1.0, 3.0])
def test_noise_of_any_colour_and_of_a_size_that_follows_the_speed_is_hardly_ever_bursts(
    tau_s, louder
):
    rng = np.random.default_rng(1)
    size = 1.0 + (louder - 1.0) * (0.5 + 0.5 * np.sin(2.0 * np.pi * TIME / PERIOD_S))
    told = [
        evidence(size * coloured(rng, tau_s), size * coloured(rng, tau_s)) > TELLS
        for _ in range(50)
    ]
    assert np.mean(told) <= 0.02


@pytest.mark.parametrize("fade_s", [0.1, 0.3])
@pytest.mark.parametrize("each_s", [1.2, 4.0])
def test_knocks_above_the_noise_are_bursts(fade_s, each_s):
    rng = np.random.default_rng(2)
    told = [
        evidence(*(2.0 * knocks(rng, each_s, fade_s) + 0.3 * coloured(rng, 0.05) for _ in range(2)))
        for _ in range(20)
    ]
    assert np.mean(np.array(told) > TELLS) >= 0.9


def test_knocks_that_repeat_with_the_motion_are_no_bursts():
    rng = np.random.default_rng(3)
    one = 2.0 * knocks(rng, 1.2, 0.3)[TIME < PERIOD_S - 1e-9]
    repeated = np.tile(one, 4)
    assert evidence(repeated + 0.3 * coloured(rng, 0.05)) < 0.0


def test_without_periods_or_with_few_samples_there_is_no_evidence():
    rng = np.random.default_rng(4)
    torque = knocks(rng, 1.2, 0.3)
    assert evidence(torque, period_s=None) == 0.0
    assert evidence(torque, period_s=35.0) == 0.0
    assert evidence(np.zeros(len(TIME))) == 0.0
