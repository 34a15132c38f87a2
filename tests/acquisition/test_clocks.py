"""Clocks that drift: found through late and uneven replies, and taken out of the recording."""

import random

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition.align import Alignment
from pipelines.acquisition.clocks import BUCKET_S, Bounds, Drift
from pipelines.acquisition.machine import Reading
from pipelines.acquisition.sampling import AIM, SECOND_LOOK


class Clock:
    """A drive's: sample n is latched at ``origin`` + n periods of its own."""

    def __init__(self, rate_hz, ppm, origin):
        self.period, self.origin = 1 / (rate_hz * (1 + 1e-6 * ppm)), origin

    def newest(self, instant):
        return int((instant - self.origin) // self.period)


def drift_of(first, other, rate_hz, duration_s, seed=0, latency_s=0.0002, cycle_s=0.005, late=0.05):
    """Ask both drives twice in each cycle, as acquisition does, some replies being very late; return what is found."""
    draw, drift = random.Random(seed), Drift(rate_hz)
    low, high = (share / rate_hz for share in SECOND_LOOK)

    def way():
        return latency_s * draw.lognormvariate(0, 0.3) + (draw.expovariate(20.0) if draw.random() < late else 0.0)

    bounds = [Bounds(1 / rate_hz) for _ in range(2)]
    now, ends = 1000.0, 1000.0 + BUCKET_S
    while now < 1000.0 + duration_s:
        for clock, its in zip((first, other), bounds, strict=True):
            aim = (its.ahead(now) or 0.0) + draw.gauss(0.0, AIM) / rate_hz
            for sent in (now + draw.uniform(0, 0.2) * cycle_s, now + min(max(aim, low), high)):
                there = sent + way()
                its.told(clock.newest(there), sent, there + way())
        now += cycle_s
        if now >= ends:
            ends = now + BUCKET_S
            drift.add(first.newest(now), bounds[0].close(), bounds[1].close())
    return drift.estimate


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 40.0])
@pytest.mark.parametrize("rate_hz", [200.0, 1000.0])
def test_offset_and_rate_are_found_within_a_tenth_of_a_sample_and_five_ppm(rate_hz, ppm):
    first, other = Clock(rate_hz, 15.0, 990.0), Clock(rate_hz, 15.0 + ppm, 985.6789)
    found = drift_of(first, other, rate_hz, 120.0)
    true_lead = (first.origin + found.at * first.period - other.origin) / other.period - found.at
    assert found.rate * 1e6 == pytest.approx(ppm, abs=5.0)
    assert (found.lead - true_lead) / rate_hz == pytest.approx(0.0, abs=max(1e-4, 0.1 / rate_hz))


def test_the_stated_errors_cover_the_truth():
    off = []
    for seed in range(10):
        first, other = Clock(1000.0, 0.0, 990.0), Clock(1000.0, 40.0, 985.0 + 0.01234 * seed)
        found = drift_of(first, other, 1000.0, 20.0, seed)
        off.append((found.rate - 40e-6) / found.rate_error)
    assert np.abs(off).max() < 3.0


def reading(sequence, time, angle):
    return Reading(sequence, time, angle, 10 * angle, angle, np.nan, 20.0, angle)


def motion(instants):
    return np.sin(2 * np.pi * instants)


def aligned(position, knee, rows=200, batch=1):
    """Feed a drive that samples at integers and another with its own samples; return the rows that come."""
    alignment, found = Alignment([position]), []
    hip = [reading(n, n / 200, motion(n / 200)) for n in range(rows)]
    for start in range(0, rows, batch):
        found += alignment.rows([hip[start : start + batch], knee[start : start + batch]])
    return found


@pytest.mark.parametrize("batch", [1, 7])
def test_a_drives_samples_are_brought_to_the_first_ones_instants(batch):
    # The knee's sample m is taken at (m + 0.3) / 200 (1 + 1e-3): it is in its sample 0.999 n - 0.3 at the hip's n.
    def at(m):
        return (m + 0.3) / 200 * (1 + 1e-3)

    knee = [reading(m, 7 + at(m), motion(at(m))) for m in range(200)]
    found = aligned(lambda n: n / (1 + 1e-3) - 0.3, knee, batch=batch)
    sequence = np.array([row[0].sequence for row in found])
    assert np.diff(sequence).tolist() == [1] * (len(sequence) - 1)
    assert len(found) > 190
    assert_allclose([row[1].angle for row in found[1:]], motion(sequence[1:] / 200), atol=2e-7)
    assert_allclose([row[1].time for row in found], 7 + sequence / 200, atol=1e-9)


def test_where_positions_are_whole_samples_they_are_handed_on_untouched():
    knee = [reading(m, m / 200, motion(m / 200)) for m in range(205)]
    found = aligned(lambda n: n + 3.0, knee)
    assert [row[1] for row in found] == knee[3:200]


def test_nothing_is_invented_where_a_sample_is_missing():
    knee = [reading(m, m / 200, motion(m / 200)) for m in range(200) if not 50 <= m < 60]
    found = [row[0].sequence for row in aligned(lambda n: n + 0.5, knee)]
    assert set(range(196)) - set(found) == set(range(49, 60))


def test_rows_wait_until_the_drift_is_known():
    known = []
    alignment = Alignment([lambda n: float(n) if known else None])
    samples = [reading(n, n / 200, 0.0) for n in range(10)]
    assert alignment.rows([samples[:5], samples[:5]]) == []
    known.append(True)
    assert len(alignment.rows([samples[5:], samples[5:]])) == 10
