"""A magnitude without its sign is named, and no channel that ends at zero or touches it is."""

import numpy as np
import pytest

from pipelines.signals.folded import is_folded, is_folded_angle
from tests.signals.torques import torque

SEEDS = 100
SECONDS = np.arange(300) / 100.0


def touching(rng, noise):
    """Return a torque that touches zero smoothly, and ends there."""
    speed, phase = rng.uniform([3.0, 0.0], [12.0, 6.0])
    values = 10.0 * (1.0 - np.cos(speed * SECONDS + phase))
    return np.maximum(np.round(values + rng.normal(0.0, noise, len(SECONDS)), 2), 0.0)


def share(channel):
    return np.mean([is_folded(channel(np.random.default_rng(seed))) for seed in range(SEEDS)])


@pytest.mark.parametrize(("noise", "least"), [(0.0, 0.9), (0.05, 0.8), (0.2, 0.5)])
@pytest.mark.parametrize("friction", [0.0, 2.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_magnitude_is_named(noise, least, friction, sign):
    assert share(lambda rng: sign * np.abs(torque(rng, SECONDS, noise, friction))) >= least


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize(
    "sign",
    [
        lambda values: np.sign(np.gradient(values)),
        lambda values: np.sign(np.roll(values, 10)),
    ],
    ids=["of its rate", "late"],
)
def test_a_magnitude_with_the_sign_of_something_else_is_named(noise, sign):
    def channel(rng):
        values = torque(rng, SECONDS)
        noisy = np.round(values + rng.normal(0.0, noise, len(values)), 2)
        return np.where(sign(values) < 0.0, -1.0, 1.0) * np.abs(noisy)

    assert share(channel) >= 0.8


@pytest.mark.parametrize(
    "channel",
    [
        lambda rng: torque(rng, SECONDS, 0.05),
        lambda rng: torque(rng, SECONDS, 0.05, 2.0),
        lambda rng: torque(rng, SECONDS, 0.5, 8.0),
        lambda rng: torque(rng, SECONDS, 3.0),
        lambda rng: np.round(torque(rng, SECONDS, 0.3)),
        lambda rng: np.round(np.cumsum(rng.normal(0.0, 0.3, len(SECONDS))), 2),
        lambda rng: 20.0 + torque(rng, SECONDS, 0.05),
        lambda rng: np.maximum(torque(rng, SECONDS, 0.05), 0.0),
        lambda rng: np.maximum(torque(rng, SECONDS, 0.5), 0.0),
        lambda rng: touching(rng, 0.0),
        lambda rng: touching(rng, 0.05),
        lambda rng: touching(rng, 0.5),
        lambda rng: np.maximum(np.round(rng.normal(0.3, 0.5, len(SECONDS))), 0.0),
        lambda rng: np.where(rng.random(len(SECONDS)) < 0.1, 0.01, torque(rng, SECONDS, 0.05)),
        lambda rng: 10.0 * (np.sin(rng.uniform(10.0, 60.0) * SECONDS) > 0.0),
        lambda rng: np.zeros(0),
        lambda rng: torque(rng, SECONDS[: rng.integers(1, 40)], 0.05),
        lambda rng: np.zeros(len(SECONDS)),
    ],
    ids=[
        *("with its sign", "with friction", "with much friction", "mostly noise", "coarse"),
        *("a random walk", "above zero", "cut off at zero", "cut off, noisy"),
        *("touching zero", "touching, some noise", "touching, noisy", "coarse at rest"),
        *("spikes to zero", "pulses", "no rows", "few rows", "all zero"),
    ],
)
def test_no_other_channel_is(channel):
    assert share(channel) <= 0.02


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_the_magnitude_of_an_angle_is_named(noise):
    def channel(rng):
        angle = 0.1 * torque(rng, SECONDS)
        return np.abs(angle + rng.normal(0.0, noise, len(angle)))

    named = [is_folded_angle(channel(np.random.default_rng(seed))) for seed in range(SEEDS)]
    assert np.mean(named) >= 0.8


@pytest.mark.parametrize(
    "channel",
    [
        lambda rng: 0.1 * torque(rng, SECONDS, 0.01),
        lambda rng: np.round(torque(rng, SECONDS), 1) % 360.0,
        lambda rng: np.zeros(0),
        lambda rng: torque(rng, SECONDS[: rng.integers(1, 40)], 0.05),
        lambda rng: np.zeros(len(SECONDS)),
    ],
    ids=["with its sign", "starts again at zero", "no rows", "few rows", "at rest"],
)
def test_an_angle_with_its_sign_is_not(channel):
    named = [is_folded_angle(channel(np.random.default_rng(seed))) for seed in range(SEEDS)]
    assert np.mean(named) <= 0.02


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_joint_that_rebounds_a_few_times_is_no_magnitude(turns):
    angle = np.abs(np.sin(np.pi * turns * SECONDS / SECONDS[-1] + 0.5))
    assert not is_folded_angle(angle + np.random.default_rng(0).normal(0.0, 1e-5, len(angle)))
