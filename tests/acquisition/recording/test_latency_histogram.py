"""What a recording tells of how long its answers took."""

import numpy as np
import pytest

from pipelines.acquisition.recording.latency_histogram import Latencies


def test_counted_durations_have_the_quantiles_of_the_durations_to_a_hundredth():
    rng = np.random.default_rng(3)
    durations = np.exp(rng.normal(np.log(2e-3), 0.6, 20_000))
    durations[77] = 0.25
    counted = Latencies()
    for seconds in durations:
        counted.add(seconds)
    told = counted.metadata()
    assert told["cycles"] == 20_000
    assert told["median_ms"] == pytest.approx(1e3 * np.median(durations), rel=0.01)
    assert told["p99_ms"] == pytest.approx(1e3 * np.quantile(durations, 0.99), rel=0.01)
    assert told["longest_ms"] == pytest.approx(250.0)


def test_what_is_too_short_or_too_long_to_be_told_apart_is_counted_all_the_same():
    counted = Latencies()
    for seconds in (0.0, 1e-9, 100.0):
        counted.add(seconds)
    assert counted.metadata()["cycles"] == 3
    assert counted.metadata()["longest_ms"] == 100_000.0


def test_a_run_that_never_began_tells_nothing():
    assert Latencies().metadata() == {}


def test_a_recording_tells_how_long_its_answers_took(record):
    told = record().metadata["latency"]
    assert told["cycles"] > 100
    assert 0.0 < told["median_ms"] <= told["p99_ms"] <= told["longest_ms"]
