"""Rates, intervals and calibration have the values that the literature gives."""

import pytest

from tests.campaigns.blind.statistics import Rate, brier, calibration_error, reliability


@pytest.mark.parametrize(
    # Newcombe (1998), Statistics in Medicine 17, table I, method 3.
    ("hits", "cases", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilsons_interval_is_the_published_one(hits, cases, low, high):
    assert Rate(hits, cases).interval == pytest.approx((low, high), abs=5e-5)


def test_no_cases_say_nothing():
    assert Rate.of([]).value is None
    assert Rate.of([]).interval == (0.0, 1.0)
    assert brier([]) is None
    assert calibration_error([]) is None


def test_brier_score_of_a_coin_that_is_called_even_is_a_quarter():
    assert brier([(0.5, True), (0.5, False)]) == pytest.approx(0.25)
    assert brier([(1.0, True), (0.0, False)]) == 0.0


def test_calibration_error_is_the_distance_from_the_diagonal():
    kept = [(0.75, True)] * 3 + [(0.75, False)]
    assert calibration_error(kept) == pytest.approx(0.0)
    assert calibration_error([(1.0, False)] * 2 + kept * 2) == pytest.approx(0.2)
    assert [str(b.happened.cases) for b in reliability([(1.0, True), (0.0, False)])] == ["1", "1"]
