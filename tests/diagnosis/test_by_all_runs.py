"""What training runs that move little do not show, and validation runs do, is sought on all
runs."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.residual_shares import residual_shares
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import RICH, session
from tests.diagnosis.test_diagnose import labels

POOR = replace(RICH, a=0.3 * RICH.a, b=0.3 * RICH.b)
"""So slow that a drag with the speed squared is a tenth of what it is on the validation runs."""


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
    alone = residual_shares(
        diagnosis.prepared.runs, diagnosis.prepared.residuals, diagnosis.prepared.noise
    )[0]
    shares = verdict(diagnosis)["router"]["hip"]
    assert shares["repeats"] > 0.04 > alone.as_json()["repeats"]


def test_its_amplitudes_are_fitted_to_the_training_runs_alone(diagnosis):
    refine = Refinement(diagnosis.prepared.runs, diagnosis.baseline, diagnosis.prepared.weights)
    by_training = refine(diagnosis.after.fit.causes)
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


@pytest.mark.slow
def test_a_payload_that_only_a_validation_run_carries_is_missing_and_not_named():
    """No training run shows its mass: fitted to these it explains nothing."""
    runs = session(seed=7)
    loaded = session("payload_change", "knee", seed=7, mass_moment=0.5, time=0.0)
    outcome = verdict(diagnose([*runs[:3], loaded[3]]))
    assert (outcome["status"], outcome["causes"], outcome["sought_on"]) == (
        "unknown_cause",
        [],
        "all",
    )
    refused = "it lowers the error on the validation runs too little, or raises it."
    assert (
        f"would explain all runs together, but fitted to the training runs alone, {refused}"
        in outcome["summary"]
    )
    differs = [caveat for caveat in outcome["caveats"] if "no training run shows" in caveat]
    assert any(caveat.startswith("the knee's torque error is 1.3") for caveat in differs)


def test_what_the_training_runs_show_is_sought_on_them():
    outcome = verdict(diagnose(session("torque_gain", "hip", seed=3, gain=1.08)))
    assert (outcome["status"], outcome["sought_on"]) == ("explained", "train")
