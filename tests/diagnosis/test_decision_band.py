"""Averages over 0.1 s: of usable blocks alone, and never across a gap."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.evidence.prepared_runs import prepare
from tests.diagnosis.sessions import session


@pytest.fixture(scope="module")
def prepared():
    runs = [observe(motion) for motion in session() if motion.purpose == "train"]
    return prepare(runs, baseline_of(runs))


def test_an_average_is_the_mean_of_its_usable_blocks(prepared):
    run = prepared.runs[1]
    band = DecisionBand.of(run)
    values = np.random.default_rng(0).normal(size=run.measured.shape)
    averaged = band.average(values)
    for average in range(0, len(band.time), 37):
        blocks = band.blocks[average]
        assert np.ptp(run.time[blocks]) < LENGTH_S
        for output in range(values.shape[1]):
            usable = run.usable[blocks, output]
            if band.weight[average, output] > 0.0:
                mean = values[blocks, output][usable].mean()
                assert averaged[average, output] == pytest.approx(mean)
            assert band.weight[average, output] in (0.0, usable.mean())


def test_no_average_reaches_across_a_gap(prepared):
    run = prepared.runs[0]
    kept = (run.time < 10.0) | (run.time > 12.03)
    cut = replace(run, time=run.time[kept], usable=run.usable[kept], measured=run.measured[kept])
    band = DecisionBand.of(cut)
    assert np.ptp(cut.time[band.blocks], axis=1).max() < LENGTH_S
