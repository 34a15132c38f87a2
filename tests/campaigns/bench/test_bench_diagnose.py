"""The diagnosis' bench runs, and tells what it is asked."""

import pytest

from tests.campaigns.bench.bench_diagnose import (
    catalogue_rows,
    length_rows,
    order_rows,
    posterior_rows,
    recorded,
)


@pytest.mark.slow
def test_the_posterior_outruns_a_refit_of_every_pair():
    library, weighed, refitted = posterior_rows(recorded(20.0), sample=10)
    assert "shapes" in library.name
    assert "sets in full" in weighed.name
    assert "scaled up from 10" in refitted.name
    assert refitted.ratio > 3.0


def test_a_smaller_catalogue_offers_fewer_shapes():
    quarter, half = catalogue_rows(recorded(15.0), (16, 8))
    effects = [int(row.name.split(" effects")[0]) for row in (quarter, half)]
    assert 0 < effects[0] < effects[1]
    shapes = [int(row.name.split(", ")[1].removesuffix(" shapes")) for row in (quarter, half)]
    assert 0 < shapes[0] < shapes[1]


@pytest.mark.slow
def test_every_length_is_compared_with_the_first():
    first, second = length_rows((12.0, 24.0))
    assert first.value.endswith("1.0 times the first's")
    assert float(second.value.split()[2]) > 0.5


@pytest.mark.slow
def test_order_tracking_is_timed_with_the_lines_that_it_finds():
    none, four = order_rows(recorded(40.0))
    assert "0 found" in none.name
    assert "4 found" in four.name
