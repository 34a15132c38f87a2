"""A value whose two words are of two samples is left out, and no true value is."""

import numpy as np
import pytest

from pipelines.acquisition.machine.torn_words import TornRows


def kept(counts, numbers=None):
    """Indices of the rows that are kept, of a value of one count per unit."""
    torn = TornRows[int]([0], [1.0 / 65536])
    rows = [row for k in numbers or range(len(counts)) for row in torn.take(k, k, [counts[k]])]
    return rows, torn.torn


MOTION = 60_000.0 * np.sin(0.04 * np.arange(300))
"""Crosses a low word's end now and then, by at most 2400 counts a row."""


def test_a_high_word_of_the_sample_before_costs_its_row():
    high = np.floor(MOTION / 65536)
    torn = MOTION - 65536 * np.diff(high, prepend=0.0)
    wrong = np.flatnonzero(torn != MOTION)
    assert len(wrong) >= 3
    rows, count = kept(torn)
    assert count == len(wrong)
    assert rows == [k for k in range(300) if k not in wrong]


@pytest.mark.parametrize("wrong", [[0], [1], [0, 1], [3], [4]])
@pytest.mark.parametrize("word", [-65536, 65536])
def test_a_torn_row_at_the_very_beginning_is_left_out(wrong, word):
    torn = MOTION.copy()
    torn[wrong] += word
    rows, count = kept(torn)
    assert count == len(wrong) and set(range(300)) - set(rows) == set(wrong)


def test_the_same_torn_sample_read_twice_costs_both_rows():
    torn = MOTION.copy()
    torn[100:102] = MOTION[99] + 65536
    assert set(range(300)) - set(kept(torn)[0]) == {100, 101}


def test_a_tear_next_to_missing_rows_is_left_out_too():
    torn = MOTION.copy()
    torn[150] += 65536
    numbers = [k for k in range(300) if k not in (147, 148, 151, 152)]
    assert set(numbers) - set(kept(torn, numbers)[0]) == {150}


@pytest.mark.parametrize(
    "counts",
    [
        MOTION,
        30.0 * MOTION,  # of a fine encoder
        np.arange(300) * 700.0 % 65536,  # of an encoder that begins anew with each turn
        np.random.default_rng(0).normal(0.0, 30_000.0, 300),  # noise
    ],
    ids=["slow", "fast", "turns", "noise"],
)
def test_no_true_value_is_left_out(counts):
    rows, torn = kept(counts)
    assert torn == 0
    assert rows == list(range(len(rows)))
    assert len(rows) >= 290, "the last few may still be held back"
