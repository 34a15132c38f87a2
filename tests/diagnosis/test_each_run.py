"""A joint that is zeroed again at every start: each run has an offset of its own, and the verdict
finds them all.

The hidden offsets are added to recorded angles, by no code of the effect's.
"""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.fit.fitted_model import values_of_each_run
from pipelines.diagnosis.fit.held_out import terms_with_own_values
from pipelines.diagnosis.fit.joint_fit import fit
from pipelines.diagnosis.fit.uncertainty import Uncertainty
from pipelines.diagnosis.verdict.figures.budget import words_of
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects import TorqueDrift, VoluntaryTorque
from tests.diagnosis.sessions import session

HIDDEN = {
    "run_0.parquet": 0.06,
    "run_1.parquet": -0.05,
    "run_2.parquet": -0.03,
    "run_3.parquet": 0.07,
}
"""rad, at the knee; runs 1 and 3 are of those that no fit sees."""


def zeroed(motion, offset):
    """Return a motion whose knee was zeroed ``offset`` rad off; commands count from there."""
    shift = np.array([0.0, offset])
    angles = {name: getattr(motion, name) + shift for name in ("q", "measured_angle", "reference")}
    return replace(motion, **angles)


@pytest.fixture(scope="module")
def diagnosis():
    return diagnose([zeroed(m, HIDDEN[m.file]) for m in session()])


@pytest.fixture(scope="module")
def outcome(diagnosis):
    return verdict(diagnosis)


def test_a_joint_zeroed_again_at_each_start_is_named_and_nothing_else(outcome):
    assert outcome["status"] == "explained"
    assert [(c["effect"], c["joint"]) for c in outcome["causes"]] == [("encoder_offset", "knee")]
    assert "per-run encoder offset at the knee" in outcome["summary"]
    assert outcome["causes"][0]["fitted_on_validate"] == ["offset"]


def test_figures_call_it_what_the_summary_calls_it(diagnosis):
    assert words_of("encoder_offset@knee", diagnosis) == "per-run encoder offset at the knee"


def test_each_run_s_own_offset_is_recovered_those_that_no_fit_saw_too(outcome):
    offsets = {one["file"]: one["values"]["offset"] for one in outcome["causes"][0]["each_run"]}
    assert offsets == pytest.approx(HIDDEN, abs=0.01)
    assert any(
        "each run has its own offset" in sentence for sentence in outcome["causes"][0]["evidence"]
    )


def test_intervals_of_the_offsets_that_were_fitted_hold_the_truth_and_the_others_have_none(outcome):
    (offset,) = outcome["causes"][0]["parameters"]
    intervals = {one["file"]: one["ci95"]["offset"] for one in outcome["causes"][0]["each_run"]}
    assert intervals["run_0.parquet"] == offset["ci95"]
    for file in ("run_0.parquet", "run_2.parquet"):
        low, high = intervals[file]
        # 0.043 rad: what the model gets wrong repeats in every period, and more of them do not
        # average it out.
        assert low <= HIDDEN[file] <= high and high - low < 0.05
    assert intervals["run_1.parquet"] is intervals["run_3.parquet"] is None


@pytest.mark.slow
def test_zeros_that_differ_only_in_the_validation_runs_are_each_run_s_own():
    hidden = {
        "run_0.parquet": 0.06,
        "run_1.parquet": -0.05,
        "run_2.parquet": 0.058,
        "run_3.parquet": -0.06,
    }
    outcome = verdict(diagnose([zeroed(m, hidden[m.file]) for m in session()]))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"], cause["fitted_on_validate"]) == (
        "encoder_offset",
        "knee",
        ["offset"],
    )
    assert {one["file"]: one["values"]["offset"] for one in cause["each_run"]} == pytest.approx(
        hidden, abs=0.01
    )


@pytest.mark.slow
def test_one_offset_in_all_runs_is_one_and_no_run_has_another():
    outcome = verdict(diagnose([zeroed(m, 0.06) for m in session()]))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("encoder_offset", "knee")
    assert cause["fitted_on_validate"] == cause["each_run"] == []
    assert cause["parameters"][0]["value"] == pytest.approx(0.06, abs=0.01)


@pytest.mark.slow
def test_a_leg_that_is_zeroed_once_needs_no_zero_of_its_own_in_any_run():
    outcome = verdict(diagnose(session(seconds=30.0)))
    assert outcome["status"] == "nothing_missing"


def test_what_runs_have_of_a_cause_of_some_of_them_is_reported_of_those_alone_each_its_own():
    pushed = session(
        "voluntary_torque", "knee", seconds=20.0, amplitude=4.0, frequency=0.37, phase=1.0
    )
    runs = [observe(m) for m in pushed]
    baseline = baseline_of(runs)
    pushes = [
        Candidate(VoluntaryTorque(joint="knee"), ((0.37,),) * 3),
        Candidate(TorqueDrift(joint="hip"), ((),) * 3),
    ]
    train, validate = (runs[0], runs[2], runs[3]), (runs[1],)
    fitted = fit(pushes, train, baseline, np.array([1.0, 1.0, 1.0, 1.0]))
    flat = Uncertainty(np.eye(len(fitted.values)), 2.0, (), np.eye(len(fitted.values)))
    values = values_of_each_run(fitted, baseline, flat, train, validate)
    assert [one["file"] for one in values["voluntary_torque@knee"]] == [
        "run_2.parquet",
        "run_3.parquet",
    ]
    assert [one["file"] for one in values["torque_drift@hip"]] == [
        f"run_{k}.parquet" for k in (0, 2, 3, 1)
    ]
    # A run alone, all else held, has the same values as in the fit of all.
    for run in train:
        for term in terms_with_own_values(fitted, run, baseline):
            names = [p.name for p in term.effect.parameters]
            alone = dict(zip(names, term.effect.physical(term.values), strict=True))
            for one in (one for one in values[term.effect.label] if one["file"] == run.motion.file):
                for name, value in one["values"].items():
                    assert value == pytest.approx(alone[name], abs=0.01)
                    low, high = one["ci95"][name]
                    assert low < value < high


def drawn(seed):
    """Return offsets of four runs, those of the two training runs to opposite sides: two that
    are nearly equal look like one."""
    draw = np.random.default_rng(seed)
    signs = draw.choice([-1.0, 1.0], 4)
    signs[2] = -signs[0]
    return dict(zip(HIDDEN, signs * draw.uniform(0.03, 0.08, 4), strict=True))


@pytest.mark.slow
def test_intervals_of_offsets_of_one_run_hold_the_truth_as_often_as_they_say():
    covered = []
    for seed in range(1, 41):
        hidden = drawn(seed)
        outcome = verdict(
            diagnose([zeroed(m, hidden[m.file]) for m in session(seconds=20.0, seed=seed)])
        )
        for cause in outcome["causes"]:
            if (cause["effect"], cause["joint"]) == ("encoder_offset", "knee") and cause[
                "each_run"
            ]:
                low, high = cause["parameters"][0]["ci95"]
                covered.append(low <= hidden["run_0.parquet"] <= high)
    # Of intervals that hold the truth 95 % of the time so few of 30 or more would by chance in one
    # of a hundred runs.
    assert len(covered) >= 30
    assert np.mean(covered) >= 0.82
