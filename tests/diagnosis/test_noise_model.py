"""The noise is read off above what wanders, and extended downwards by its spectrum."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.noise_model import NoiseModel, _spectrum_of

RATE_HZ = 40.0
ACTING_HZ = 0.7


def coloured(rng: np.random.Generator, n: int, rms: float, tau: float) -> np.ndarray:
    """Return first-order noise."""
    memory = np.exp(-1.0 / (RATE_HZ * tau)) if tau else 0.0
    white = rng.normal(size=n) * rms * np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], white, zi=[memory * rng.normal() * rms])[0]


def density(rms: float, tau: float) -> float:
    """Return the density of the same where columns move."""
    memory = np.exp(-1.0 / (RATE_HZ * tau)) if tau else 0.0
    zero = rms**2 * (1.0 + memory) / (1.0 - memory) / RATE_HZ
    return zero / (1.0 + (2.0 * np.pi * ACTING_HZ * tau) ** 2)


def acting(series: list[np.ndarray]) -> float:
    """Return the density that the model finds where columns move."""
    model = np.array(_spectrum_of(series, RATE_HZ, (0.25, 6.0)))[:, np.newaxis]
    return float(NoiseModel(*model, from_periods=True).at(np.array([ACTING_HZ]))[0, 0])


@pytest.mark.parametrize("tau", [0.0, 0.02, 0.06])
def test_the_density_where_columns_move_is_that_of_the_noise(tau):
    rng = np.random.default_rng(3)
    densities = [acting([coloured(rng, 2400, 0.5, tau) for _ in range(2)]) for _ in range(20)]
    assert np.mean(densities) == pytest.approx(density(0.5, tau), rel=0.2)
    assert np.std(densities) < 0.35 * np.mean(densities)


@pytest.mark.parametrize("share", [0.6, 0.33, 0.2])
def test_above_the_motion_noise_is_known_through_gaps(share):
    """A joint that often stands still is known in short stretches only; it counts all the same."""
    rng, true, densities = np.random.default_rng(1), 0.3**2 / RATE_HZ, []
    for _ in range(20):
        x, at = np.full(2400, np.nan), 0
        while at < len(x):
            length = int(rng.integers(10, 50))
            x[at : at + length] = 0.3 * rng.normal(size=len(x[at : at + length]))
            at += length + int(rng.exponential(30.0 * (1.0 / share - 1.0)))
        densities.append(_spectrum_of([x], RATE_HZ, (4.0, 8.0), 0.2)[0])
    assert 0.7 * true < np.median(densities) < 1.8 * true
    assert np.all((np.array(densities) > 0.1 * true) & (np.array(densities) < 10.0 * true))


def test_pink_noise_is_known_to_grow_towards_low_frequencies():
    rng = np.random.default_rng(6)
    frequency = np.fft.rfftfreq(4800, 1.0 / RATE_HZ)
    ratios = []
    for _ in range(20):
        white = np.fft.rfft(rng.normal(size=4800))
        white[1:] *= np.sqrt(1.5 / frequency[1:])
        white[0] = 0.0
        ratios.append(acting([np.fft.irfft(white)]))
    assert np.mean(ratios) == pytest.approx(1.5 / ACTING_HZ / RATE_HZ, rel=0.2)


def test_a_step_in_one_of_several_periods_is_not_noise():
    rng = np.random.default_rng(7)
    pieces = [coloured(rng, 800, 0.3, 0.0) for _ in range(4)]
    still = acting([np.concatenate(pieces)])
    pieces[1] = pieces[1] + 3.0 * (np.arange(800) > 300)
    assert acting([np.concatenate(pieces)]) == pytest.approx(still, rel=0.3)


def test_what_wanders_is_not_counted_as_noise():
    rng = np.random.default_rng(4)
    time = np.arange(2400) / RATE_HZ
    noise = coloured(rng, 2400, 0.3, 0.0)
    wander = 2.0 * np.sin(2.0 * np.pi * 0.05 * time) + np.sin(2.0 * np.pi * 0.17 * time + 1.0)
    still, *_ = _spectrum_of([noise], RATE_HZ, (1.5, 6.0))
    moved, *_ = _spectrum_of([noise + wander], RATE_HZ, (1.5, 6.0))
    assert moved == pytest.approx(still, rel=0.1)


def test_samples_that_are_not_usable_change_nothing_but_the_spread():
    rng = np.random.default_rng(5)
    noise = coloured(rng, 4800, 0.4, 0.02)
    gaps = np.where(rng.random(4800) < 0.3, np.nan, noise)
    whole, *_ = _spectrum_of([noise], RATE_HZ, (1.5, 6.0))
    holed, *_ = _spectrum_of([gaps], RATE_HZ, (1.5, 6.0))
    assert holed == pytest.approx(whole, rel=0.25)


@pytest.mark.parametrize("period_s", [5.0, 5.01, 5.3])
def test_a_motion_that_repeats_without_noise_has_none_beside_a_gap_either(period_s):
    """Where a period is no whole number of blocks, the later one is interpolated: not across a gap,
    and not from a block that is not usable."""
    time = np.arange(0.0, 20.0, 0.025)
    time = time[(time < 7.0) | (time > 9.0)]
    usable = np.ones((len(time), 1), bool)
    usable[(time > 14.0) & (time < 14.1)] = False
    residual = np.where(usable, 2.0 * np.sin(2.0 * np.pi * time / period_s)[:, np.newaxis], 50.0)
    run = SimpleNamespace(
        time=time,
        usable=usable,
        block=SimpleNamespace(decimation=5),
        motion=SimpleNamespace(sample_rate_hz=200.0, period_s=period_s),
    )
    differences = scatter(run, residual)
    assert np.isfinite(differences).sum() > 300
    # Linear interpolation between two blocks is a little off.
    assert np.nanmax(np.abs(differences)) < 2.0 * (2.0 * np.pi / period_s * 0.025) ** 2
