"""Thinning keeps what a reader looks for: a spike, a gap, and nothing that was not measured."""

import numpy as np
import pytest

from pipelines.plotting.chart import Chart, Panel, Role, Series, thinned_alike
from pipelines.plotting.downsampling import extremes

ROWS = 2000


@pytest.fixture
def recording():
    rng = np.random.default_rng(1)
    time = np.arange(200_000) / 1000
    return np.column_stack([np.sin(time), 0.1 * rng.standard_normal(len(time)), np.cos(3 * time)])


@pytest.mark.parametrize("where", [0, 1, 777, 123_456, 199_998, 199_999])
def test_a_spike_of_one_sample_survives_a_hundredfold_thinning(recording, where):
    recording[where, 1] = 9.0
    kept = extremes(recording, ROWS)
    assert where in kept
    assert len(kept) <= ROWS


def test_a_gap_of_one_sample_survives(recording):
    recording[54_321, 2] = np.nan
    assert 54_321 in extremes(recording, ROWS)


def test_no_fiftieth_of_the_recording_loses_what_it_reaches(recording):
    kept, longest = extremes(recording, ROWS), len(recording) * 9 // ROWS + 1
    for part in np.array_split(np.arange(len(recording)), 50):
        stays, inner = (
            recording[kept[(kept >= part[0]) & (kept <= part[-1])]],
            recording[part[longest:-longest]],
        )
        assert (stays.max(axis=0) >= inner.max(axis=0)).all()
        assert (stays.min(axis=0) <= inner.min(axis=0)).all()


def test_the_room_is_used(recording):
    assert len(extremes(recording[:, :1], ROWS)) > ROWS / 2


def test_what_fits_stays_whole(recording):
    assert np.array_equal(extremes(recording[:ROWS], ROWS), np.arange(ROWS))


def chart(key, rows):
    time = np.arange(rows) / 100
    return Chart(
        key, key, "", "time, s", time, (Panel("y", (Series("y", np.sin(time**2), Role.AFTER),)),)
    )


def test_charts_share_the_room_and_the_short_one_keeps_all():
    short, long, longer = thinned_alike(
        [chart("a", 500), chart("b", 30_000), chart("c", 90_000)], 12_000
    )
    assert (len(short.x), short.rows) == (500, 0)
    assert (long.rows, longer.rows) == (30_000, 90_000)
    assert sum(len(one.x) * one.width for one in (short, long, longer)) <= 12_000
    assert set(long.x) <= set(chart("b", 30_000).x)
