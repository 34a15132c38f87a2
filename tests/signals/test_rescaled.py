"""A channel whose decimal point moves is named, and no other is."""

import numpy as np
import pytest

from pipelines.signals.held import new_values
from pipelines.signals.rescaled import is_rescaled
from tests.signals.torques import torque

SEEDS = 200
SECONDS = np.arange(600) / 100.0


def share(channel):
    channels = (channel(np.random.default_rng(seed)) for seed in range(SEEDS))
    return np.mean([is_rescaled(values[new_values(values)]) for values in channels])


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("friction", [0.0, 2.0])
@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_decimal_point_that_moves_is_named(noise, friction, factor):
    def channel(rng):
        values = torque(rng, SECONDS, noise, friction)
        return np.where(np.abs(values) < 4.0, factor * values, values)

    assert share(channel) >= 0.8


@pytest.mark.parametrize(
    "channel",
    [
        lambda rng: torque(rng, SECONDS),
        lambda rng: torque(rng, SECONDS, 0.05, 2.0),
        lambda rng: torque(rng, SECONDS, 0.5, 8.0),
        lambda rng: torque(rng, SECONDS, 5.0),
        lambda rng: np.abs(torque(rng, SECONDS, 0.05, 2.0)),
        lambda rng: np.round(torque(rng, SECONDS, 0.3)),
        lambda rng: np.where(rng.random(len(SECONDS)) < 0.02, 0.0, torque(rng, SECONDS)),
        lambda rng: np.round(np.cumsum(rng.normal(0.0, 0.3, len(SECONDS))), 2),
        lambda rng: 1.0 + 9.0 * (np.sin(rng.uniform(10.0, 60.0) * SECONDS) > 0.5 * SECONDS),
        lambda rng: np.zeros(0),
        lambda rng: np.zeros(len(SECONDS)),
    ],
    ids=[
        *("smooth", "with friction", "much friction", "mostly noise", "a magnitude", "coarse"),
        *("outliers", "a random walk", "pulses that end", "no rows", "all zero"),
    ],
)
def test_no_other_channel_is(channel):
    assert share(channel) <= 0.01
