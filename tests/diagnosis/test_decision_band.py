"""Averages over 0.1 s, and columns at block rate, say what the full rate says."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import Candidate, proposals
from pipelines.diagnosis.candidates.columns import signatures
from pipelines.diagnosis.candidates.shape_grid import values_in
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.block_rate import at_block_rate, needs_full_rate
from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.evidence.prepared_runs import prepare
from tests.diagnosis.sessions import session


@pytest.fixture(scope="module")
def prepared():
    runs = [observe(motion) for motion in session(seconds=30.0) if motion.purpose == "train"]
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


def _shape(effect, runs) -> tuple[float, ...]:
    """Return a shape in the middle of the effect's range."""
    if chosen := effect.directions([run.motion for run in runs]):
        return chosen[0][0]
    found = []
    for parameter in effect.shape:
        values = values_in(effect, parameter, 3, runs)
        found.append(float(values[len(values) // 2]))
    return tuple(found)


def test_columns_at_block_rate_are_those_at_full_rate(prepared):
    baseline, runs = prepared.baseline, prepared.runs
    slow = [at_block_rate(run) for run in runs]
    plain = [columns_under((), run, baseline)[0] for run in slow]
    bands = [DecisionBand.of(run) for run in runs]

    def rows(parts):
        return np.concatenate([b.average(p)[b.weight > 0.0] for b, p in zip(bands, parts, strict=True)])

    checked = 0
    for effect in proposals(baseline, [run.motion.run for run in runs]):
        fast = effect.joint is not None and any(p.unit == "1/turn" for p in effect.shape)
        if needs_full_rate(effect) or fast or not effect.shows_in([r.motion for r in runs]):
            continue
        candidate = Candidate(effect, (_shape(effect, runs),) * len(runs))
        exact = rows(signatures(candidate, runs, baseline, prepared.columns, prepared.weights))
        near = rows(signatures(candidate, slow, baseline, plain, prepared.weights))
        size = np.linalg.norm(exact)
        assert np.linalg.norm(near - exact) < 0.03 * size + 1e-9, effect.label
        checked += size > 0.0
    assert checked > 20
