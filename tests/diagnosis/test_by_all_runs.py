"""What training runs that move little do not show, and validation runs do, is sought on all
runs."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.noise_floor import noise_floor
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.diagnosis.evidence.residual_shares import residual_shares
from pipelines.diagnosis.fit.held_out import halves
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation_scheme import CrossValidation
from pipelines.diagnosis.judged_fit import JudgedFit
from pipelines.diagnosis.verdict import unexplained as module_of_unexplained
from pipelines.diagnosis.verdict.error_budget import _mean_square, shares_of_causes
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.naming import naming
from tests.diagnosis.sessions import RICH, diagnosed, session
from tests.diagnosis.test_diagnose import labels

pytestmark = pytest.mark.long

POOR = replace(RICH, a=0.3 * RICH.a, b=0.3 * RICH.b)
"""So slow that a drag with the speed squared is a tenth of what it is on the validation runs."""

SLOWEST = replace(RICH, a=0.15 * RICH.a, b=0.15 * RICH.b)
"""So slow that such a drag is a fiftieth."""


@pytest.fixture(scope="module")
def diagnosis():
    return diagnosed("quadratic_drag", "hip", seed=7, seconds=40.0, trained=POOR, drag=6.0)


@pytest.fixture(scope="module")
def outcome(diagnosis):
    return verdict(diagnosis)


def test_a_drag_that_slow_training_runs_do_not_show_is_named_by_all_runs(outcome):
    assert outcome["sought_on"] == "all"
    assert ("quadratic_drag", "hip") in labels(outcome["causes"][0])
    assert any("the training runs alone name no cause" in caveat for caveat in outcome["caveats"])


def test_the_residual_is_split_by_the_runs_that_were_searched(diagnosis, outcome):
    """In the slow training runs all of it is noise."""
    prepared = prepare(diagnosis.data.train, diagnosis.baseline)
    alone = residual_shares(prepared.runs, prepared.residuals, prepared.noise)[0]
    shares = outcome["router"]["hip"]
    assert shares["repeats"] > 0.04 > alone.repeats


def test_its_amplitudes_are_fitted_to_the_training_runs_alone(diagnosis, outcome):
    assert outcome["fitted_to"] == "train"
    prepared = prepare(diagnosis.data.train, diagnosis.baseline)
    refine = Refinement(prepared.runs, diagnosis.baseline, prepared.weights)
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


@pytest.fixture(scope="module")
def cross_validated():
    """A drag on training runs so slow that its torque there is lost in the noise."""
    return diagnose(session("quadratic_drag", "hip", seed=7, trained=SLOWEST, drag=6.0))


def test_a_cause_whose_size_no_training_run_shows_is_cross_validated(cross_validated):
    outcome = verdict(cross_validated)
    (cause,) = outcome["causes"]
    assert ("quadratic_drag", "hip") in labels(cause)
    assert (outcome["sought_on"], outcome["fitted_to"]) == ("all", "all")
    (drag,) = cause["parameters"]
    low, high = drag["ci95"]
    assert 0.0 < low < 6.0 < high
    assert cause["gain"]["ci95"][0] > 0.0
    (caveat,) = (one for one in outcome["caveats"] if "sought on all runs" in one)
    assert caveat.endswith(
        "the gain is a little too good: record training runs that show the causes"
    )


@pytest.mark.parametrize(
    ("label", "half"),
    [
        (("load_dependent_friction", "hip"), 0),
        (("backlash", "hip"), 1),
        pytest.param(("load_dependent_friction", "hip"), 1, marks=pytest.mark.slow),
        pytest.param(("backlash", "hip"), 0, marks=pytest.mark.slow),
    ],
)
def test_each_half_is_predicted_by_a_fit_that_has_not_seen_it(cross_validated, label, half):
    """Torque that one half alone has changes the prediction of the other half, and not of it, with
    a cause that needs a load and with a transmission too."""
    name, joint = label
    library = cross_validated.selected.library
    (cause, *_) = (c.candidate for c in library.causes if c.candidate.label == f"{name}@{joint}")
    cause = replace(cause, bodies=())
    d = cross_validated
    changed = tuple(_with_torque_in(half, run) for run in d.data.validate)
    before, after = (
        CrossValidation(d.data.train, validate, d.baseline).validated([cause])
        for validate in (d.data.validate, changed)
    )
    runs = zip(before.runs, after.runs, before.residuals, after.residuals, strict=True)
    for run, other, was, now in runs:
        moved = np.abs((other.measured - now) - (run.measured - was))[:, 0]
        own = halves(run) == half
        assert moved[own].max() < 1e-9
        assert moved[~own].max() > 0.1


def _with_torque_in(half, run):
    pushed = run.measured.copy()
    pushed[halves(run) == half, 0] += 20.0
    return replace(run, measured=pushed)


def test_the_steps_between_the_two_fits_are_no_noise(cross_validated):
    """The floor is that of the fit to all runs."""
    alone = cross_validated.before
    assert alone.without_steps is not None
    smooth = noise_floor(alone.runs, alone.without_steps)
    np.testing.assert_array_equal(alone.floor.rms, smooth.rms)


def test_what_the_validation_runs_measure_is_learnt_from_training_runs(
    cross_validated, monkeypatch
):
    """Though the model is fitted to all runs."""
    seen = []
    term = module_of_unexplained.smooth_term
    monkeypatch.setattr(
        module_of_unexplained,
        "smooth_term",
        lambda runs, residuals: seen.append((runs, residuals)) or term(runs, residuals),
    )
    monkeypatch.setattr(module_of_unexplained, "describe", lambda *_: "")
    module_of_unexplained.unexplained(cross_validated, [])
    ((runs, residuals),) = seen
    assert [run.motion.file for run in runs] == ["run_0.parquet", "run_2.parquet"]
    assert [len(residual) for residual in residuals] == [len(run.time) for run in runs]


def test_causes_that_were_cross_validated_together_share_the_budget(cross_validated):
    """The parts of two causes add up to what both remove, each refitted without the other."""
    d = naming(cross_validated, "quadratic_drag@hip", "torque_offset@knee")
    assert verdict(d)["fitted_to"] == "all"
    removed = d.before.errors.rms**2 - d.after.errors.rms**2
    parts = shares_of_causes(d.causes, lambda labels: _mean_square(d, labels))
    np.testing.assert_allclose(sum(parts.values()), removed, atol=1e-12)


@pytest.mark.slow
def test_where_cross_validation_fails_no_cause_is_named(monkeypatch):
    tried = []
    monkeypatch.setattr(
        JudgedFit, "predicts_better_than", lambda self, *_: bool(tried.append(self.scheme))
    )
    outcome = verdict(diagnose(session("quadratic_drag", "hip", seed=7, trained=SLOWEST, drag=6.0)))
    assert isinstance(tried[-1], CrossValidation)
    assert (outcome["status"], outcome["causes"]) == ("unknown_cause", [])
    assert (outcome["sought_on"], outcome["fitted_to"]) == ("all", "train")
    refused = (
        "in cross-validation it lowers the error on the validation runs too little, or raises it"
    )
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
    spring = dict(stiffness=6.0, rest_angle=-0.5)
    outcome = verdict(diagnosed("parallel_spring", "knee", seed=4, **spring))
    assert (outcome["status"], outcome["sought_on"]) == ("explained", "train")
