import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pipelines.signals.blocks import BlockAverage, dilate


@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(1, 7))
def test_a_block_never_reaches_across_a_gap(lengths, width):
    segment = np.repeat(np.arange(len(lengths)), lengths)
    block = BlockAverage(width)
    starts = block.starts(segment)
    assert len(starts) == sum(n // width for n in lengths)
    for start in starts:
        assert len(set(segment[start : start + width])) == 1


def test_the_mean_of_a_line_is_its_middle():
    x = np.arange(20.0)
    block = BlockAverage(5)
    assert_allclose(block.mean(x, block.starts(np.zeros(20))), [2, 7, 12, 17])


def test_one_bad_sample_spoils_its_block_only():
    good = np.ones(20, dtype=bool)
    good[7] = False
    block = BlockAverage(5)
    assert list(block.all(good, block.starts(np.zeros(20)))) == [True, False, True, True]


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(0, 8))
def test_dilation_reaches_as_far_as_it_says(flags, reach):
    x = np.array(flags)
    spread = dilate(x, reach)
    expected = [any(x[max(0, i - reach) : i + reach + 1]) for i in range(len(x))]
    assert list(spread) == expected
