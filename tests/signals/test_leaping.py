"""A motion that leaps is named; one that moves fast, rests or is coarse is not."""

import numpy as np
import pytest

from pipelines.signals.leaping import leaps

TIME_S = np.arange(1000) / 100.0


def swing(rng):
    speeds, phases = rng.uniform(1.0, 6.0, 3), rng.uniform(0.0, 6.0, 3)
    motion = np.sin(np.outer(TIME_S, speeds) + phases) @ rng.uniform(0.1, 0.4, 3)
    return motion + rng.normal(0.0, 1e-4, len(TIME_S))


@pytest.mark.parametrize("seed", range(20))
def test_a_record_that_begins_in_its_middle_is_named_at_its_seam(seed):
    rng = np.random.default_rng(seed)
    motion = swing(rng) + np.linspace(0.0, 1.5, len(TIME_S))
    row = int(rng.integers(100, 900))
    rolled = np.roll(motion, row)
    assert leaps(TIME_S, rolled).tolist() == [row]


@pytest.mark.parametrize(
    "channel",
    [
        swing,
        lambda rng: np.round(swing(rng), 2),
        lambda rng: np.round(swing(rng), 1),
        lambda rng: np.round(rng.normal(0.0, 0.2, len(TIME_S))) * 1e-4,
        lambda rng: np.r_[0.0, np.full(len(TIME_S) - 1, 1e-4)],
        lambda rng: np.sign(swing(rng)),
        lambda rng: rng.normal(0.0, 1.0, len(TIME_S)),
        lambda rng: np.full(len(TIME_S), np.nan),
    ],
    ids=[
        *("a swing", "coarse", "coarser", "a count at rest", "one count", "from stop to stop"),
        *("noise", "nothing"),
    ],
)
def test_no_other_motion_leaps(channel):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        # Rows come late now and then.
        time_s = np.sort(TIME_S + rng.uniform(0.0, 0.004, len(TIME_S)))
        assert leaps(time_s, channel(rng)).tolist() == []
