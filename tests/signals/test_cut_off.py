"""A channel that is cut off within its range is named, and no other is."""

import numpy as np
import pytest

from pipelines.signals.cut_off import cut_off_at

SEEDS = 200
SECONDS = np.arange(1000) / 100.0


def torque(rng, noise=0.0, friction=0.0, step=0.01):
    """Return a torque of about 10 N·m that crosses zero, in steps."""
    speed, *phases = rng.uniform([3.0, 0.0, 0.0, 0.0], [12.0, 6.0, 6.0, 6.0])
    values = 10.0 * np.sin(speed * SECONDS + phases[0])
    values += 3.0 * np.sin(0.3 * speed * SECONDS + phases[1])
    values += friction * np.sign(np.cos(speed * SECONDS + phases[2]))
    return np.round((values + rng.normal(0.0, noise, len(SECONDS))) / step) * step


def share(channel):
    return np.mean([bool(cut_off_at(channel(np.random.default_rng(k)))) for k in range(SEEDS)])


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("friction", [0.0, 2.0])
def test_a_channel_that_is_cut_off_is_named(noise, friction):
    assert share(lambda rng: np.clip(torque(rng, noise, friction), -7.0, 7.0)) >= 0.9


def test_the_ends_are_given():
    values = torque(np.random.default_rng(0))
    assert cut_off_at(np.clip(values, -6.0, 5.0)) == (-6.0, 5.0)
    assert cut_off_at(np.clip(values, -np.inf, 5.0)) == (5.0,)


def trapezoids(rng, rounding):
    """Return the torque of friction alone, on a motion of constant speeds, through a low pass."""
    sign = np.sign(np.sin(rng.uniform(1.0, 5.0) * SECONDS))
    kernel = rng.uniform(0.3, 0.9) ** np.arange(60)
    filtered = np.convolve(3.0 * sign, kernel / kernel.sum())[: len(sign)]
    return np.round(filtered, rounding)


@pytest.mark.parametrize(
    "channel",
    [
        lambda rng: torque(rng),
        lambda rng: torque(rng, 0.05, 2.0),
        lambda rng: torque(rng, 0.0, 8.0, step=0.1),
        lambda rng: torque(rng, step=0.5),
        lambda rng: torque(rng, step=2.0),
        lambda rng: np.abs(torque(rng)),
        lambda rng: trapezoids(rng, 1),
        lambda rng: trapezoids(rng, 2),
        lambda rng: 3.0 * np.sign(np.sin(rng.uniform(1.0, 20.0) * SECONDS)),
        lambda rng: np.repeat(torque(rng)[::5], 5),
        lambda rng: np.zeros(0),
        lambda rng: np.zeros(len(SECONDS)),
        lambda rng: np.full(len(SECONDS), np.nan),
    ],
    ids=[
        *("smooth", "with friction", "much friction", "coarse", "coarser", "a magnitude"),
        *("filtered friction", "finer", "friction alone", "held", "no rows", "all zero", "blank"),
    ],
)
def test_no_other_channel_is(channel):
    assert share(channel) <= 0.01
