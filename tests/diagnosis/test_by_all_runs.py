"""What training runs that move little do not show, and validation runs do, is sought on all
runs."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.diagnosis.evidence.residual_shares import residual_shares
from pipelines.diagnosis.fit.held_out import halves
from pipelines.diagnosis.fit.trial import HoldOut
from pipelines.diagnosis.judged_fit import JudgedFit
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import RICH, session
from tests.diagnosis.test_diagnose import labels

POOR = replace(RICH, a=0.3 * RICH.a, b=0.3 * RICH.b)
"""So slow that a drag with the speed squared is a tenth of what it is on the validation runs."""

SLOW = replace(RICH, a=0.15 * RICH.a, b=0.15 * RICH.b)
"""So slow that such a drag is a fiftieth."""


@pytest.fixture(scope="module")
def diagnosis():
    return diagnose(session("quadratic_drag", "hip", seed=7, seconds=40.0, trained=POOR, drag=6.0))


def test_a_drag_that_slow_training_runs_do_not_show_is_named_by_all_runs(diagnosis):
    outcome = verdict(diagnosis)
    assert outcome["sought_on"] == "all"
    assert ("quadratic_drag", "hip") in labels(outcome["causes"][0])
    assert any("the training runs alone name no cause" in caveat for caveat in outcome["caveats"])


def test_the_residual_is_split_by_the_runs_that_were_searched(diagnosis):
    """In the slow training runs all of it is noise."""
    prepared = prepare(diagnosis.data.train, diagnosis.baseline)
    alone = residual_shares(prepared.runs, prepared.residuals, prepared.noise)[0]
    shares = verdict(diagnosis)["router"]["hip"]
    assert shares["repeats"] > 0.04 > alone.as_json()["repeats"]


def test_its_amplitudes_are_fitted_to_the_training_runs_alone(diagnosis):
    assert verdict(diagnosis)["fitted_to"] == "train"
    prepared = prepare(diagnosis.data.train, diagnosis.baseline)
    by_training = HoldOut.of(prepared, diagnosis.data.validate)(diagnosis.after.fit.causes).fit
    np.testing.assert_allclose(diagnosis.after.fit.values, by_training.values, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_where_nothing_is_missing_all_runs_show_nothing_either():
    """Values fitted to slow runs leave an error above the noise on fast ones: all runs are
    searched."""
    searched = diagnose(session(seed=7, trained=POOR))
    assert searched.before.leaves_more_than_noise
    outcome = verdict(searched)
    assert (outcome["status"], outcome["sought_on"]) == ("nothing_missing", "train")
    assert not any("sought on all runs" in caveat for caveat in outcome["caveats"])


@pytest.fixture(scope="module")
def still():
    """A drag on training runs so slow that its torque there is lost in the noise."""
    return diagnose(session("quadratic_drag", "hip", seed=7, seconds=40.0, trained=SLOW, drag=6.0))


def test_a_cause_whose_size_no_training_run_shows_is_cross_validated(still):
    outcome = verdict(still)
    (cause,) = outcome["causes"]
    assert ("quadratic_drag", "hip") in labels(cause)
    assert (outcome["sought_on"], outcome["fitted_to"]) == ("all", "all")
    (drag,) = cause["parameters"]
    low, high = drag["ci95"]
    assert 0.0 < low < 6.0 < high
    assert cause["gain"]["ci95"][0] > 0.0
    assert any("Nor do they show its size" in caveat for caveat in outcome["caveats"])


def test_each_half_is_scored_by_a_fit_that_has_not_seen_it(still):
    """Torque that one half alone has changes what is predicted of the other half, not of it."""
    causes = still.after.fit.causes
    before = still.trial(causes)
    changed = [_with_torque_in_one_half(run) for run in still.data.validate]
    after = replace(still.trial, validate=tuple(changed))(causes)
    runs = zip(before.runs, after.runs, before.residuals, after.residuals, strict=True)
    for run, other, was, now in runs:
        moved = np.abs((other.measured - now) - (run.measured - was))[:, 0]
        first = halves(run) == 0
        assert moved[first].max() < 1e-9
        assert moved[~first].max() > 0.1


def _with_torque_in_one_half(run):
    pushed = run.measured.copy()
    pushed[halves(run) == 0, 0] += 20.0
    return replace(run, measured=pushed)


@pytest.mark.slow
def test_where_cross_validation_fails_no_cause_is_named(monkeypatch):
    monkeypatch.setattr(JudgedFit, "predicts_better_than", lambda *_: False)
    outcome = verdict(
        diagnose(session("quadratic_drag", "hip", seed=7, seconds=40.0, trained=SLOW, drag=6.0))
    )
    assert (outcome["status"], outcome["causes"]) == ("unknown_cause", [])
    assert (outcome["sought_on"], outcome["fitted_to"]) == ("all", "train")
    refused = "cross-validated, it lowers the error on the validation runs too little, or raises it"
    assert f"would explain all runs together, but {refused}." in outcome["summary"]


@pytest.mark.slow
def test_a_payload_that_only_a_validation_run_carries_is_named():
    """No training run shows its mass. Half of that run does, and predicts the other half."""
    runs = session(seed=7)
    loaded = session("payload_change", "knee", seed=7, mass_moment=0.5, time=0.0)
    outcome = verdict(diagnose([*runs[:3], loaded[3]]))
    (cause,) = outcome["causes"]
    assert ("payload_change", "knee") in labels(cause)
    assert (outcome["status"], outcome["fitted_to"]) == ("explained", "all")
    mass = next(p for p in cause["parameters"] if p["name"] == "mass_moment")
    (carrying,) = {one["values"]["time"] is not None for one in cause["each_run"][:3]}
    # A mass in one run is the same as a mass that the others lack.
    sign = -1.0 if carrying else 1.0
    low, high = sorted(sign * end for end in mass["ci95"])
    assert low < 0.5 < high
    files = [one["file"] for one in cause["each_run"]]
    assert files == ["run_0.parquet", "run_2.parquet", "run_1.parquet", "run_3.parquet"]


def test_what_the_training_runs_show_is_sought_on_them():
    outcome = verdict(diagnose(session("torque_gain", "hip", seed=3, gain=1.08)))
    assert (outcome["status"], outcome["sought_on"]) == ("explained", "train")
