"""The latencies of the answers in a recording's metadata."""

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
    latency = counted.metadata()
    assert latency["cycles"] == 20_000
    assert latency["median_ms"] == pytest.approx(1e3 * np.median(durations), rel=0.01)
    assert latency["p99_ms"] == pytest.approx(1e3 * np.quantile(durations, 0.99), rel=0.01)
    assert latency["longest_ms"] == pytest.approx(250.0)


def test_times_that_are_shorter_or_longer_than_all_bins_are_counted():
    counted = Latencies()
    for seconds in (0.0, 1e-9, 100.0):
        counted.add(seconds)
    assert counted.metadata()["cycles"] == 3
    assert counted.metadata()["longest_ms"] == 100_000.0


def test_a_run_that_never_began_has_no_latencies():
    assert Latencies().metadata() == {}


def test_a_recording_has_the_latencies_of_its_answers(record):
    latency = record().metadata["latency"]
    assert latency["cycles"] > 100
    assert 0.0 < latency["median_ms"] <= latency["p99_ms"] <= latency["longest_ms"]
