"""The summary: two sentences that say what is missing, what naming it gains, and where more is
left."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Table
from pipelines.contracts.verdict import Cause, Tie
from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.shape_refinement import reach
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.fit.validation_error import Errors, scored
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.diagnosis.verdict.cause_evidence import cause_evidence
from pipelines.diagnosis.verdict.caveats import _at_ends, _default_length, caveats
from pipelines.diagnosis.verdict.summary import _in_words, finding_in_words
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects.passive_joint_torque import PassiveJointTorque
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.machine import machine_of
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.naming import missing, naming
from tests.diagnosis.sessions import recordings
from tests.once import once

LABEL = "parallel_spring@knee"
SPRING = Cause.model_construct(
    effect="parallel_spring", joint="knee", probability=0.97, indistinguishable_from=[]
)
TILT = Tie.model_construct(effect="base_tilt", joint=None)
STRIBECK = SPRING.model_copy(update={"effect": "stribeck_friction", "joint": "hip"})


@once
def diagnosed_stuck():
    """Return a diagnosis of a spring at the knee; in one run to validate on the hip's encoder
    stands for five seconds."""
    motions = []
    for number, table in enumerate(
        recordings("parallel_spring", "knee", seed=4, seconds=40.0, stiffness=6.0, rest_angle=-0.5)
    ):
        frame = table.frame.copy()
        if number == 1:
            frame.loc[1600:2600, "hip_angle_rad"] = frame.loc[1600, "hip_angle_rad"]
        motion = motion_from_table(motion_table(Table(frame, table.metadata), FilterSettings()))
        motions.append(replace(motion, file=f"run_{number}.parquet"))
    return diagnose(motions)


@pytest.fixture(scope="module")
def stuck():
    return naming(diagnosed_stuck(), LABEL)


def errors(rms):
    """Return errors of which each joint has this root mean square."""
    return Errors(np.array([rms]) ** 2, np.array([1]), np.array(rms), np.array([True, True]))


def with_errors(d, floor, baseline, extended):
    """Return the diagnosis with another noise floor and other errors, N·m at hip and knee each."""
    before, after = (
        replace(validated, errors=errors(rms))
        for validated, rms in ((d.before, baseline), (d.after, extended))
    )
    wide = np.append(floor, [np.nan, np.nan])
    return replace(
        d, floor=replace(d.floor, rms=wide), before=before, after=after, without={LABEL: before}
    )


def without_gain(d, times):
    """Return the diagnosis whose cause, left out, leaves so many times the squared error that it
    leaves named."""
    less = replace(d.after, errors=replace(d.after.errors, squares=times * d.after.errors.squares))
    return replace(d, without={LABEL: less})


def test_a_fault_that_was_masked_is_reported_with_the_cause(stuck):
    outcome = verdict(stuck)
    summary = outcome["summary"]
    assert summary.startswith("Missing from the simulation: parallel spring at the knee")
    assert (
        "Faults of acquisition were found as well: run_1.parquet, hip_angle_rad: the hip's angle is"
        " stuck" in summary
    )
    assert summary.startswith(outcome["finding"])
    assert "acquisition" not in outcome["finding"]


def test_faults_that_the_summary_leaves_out_are_counted_in_words(stuck):
    data = [replace(stuck.data, faults=stuck.data.faults[:1] * number) for number in (1, 2, 3)]
    summaries = [verdict(replace(stuck, data=one))["summary"] for one in data]
    assert "data_faults" not in summaries[0]
    assert summaries[1].endswith("(and 1 more fault, in data_faults of verdict.json).")
    assert summaries[2].endswith("(and 2 more faults, in data_faults of verdict.json).")


def test_what_is_left_at_the_other_joint_is_said_to_be_there_and_how_much(stuck):
    finding = finding_in_words(
        with_errors(stuck, [0.5, 0.3], [0.6, 2.4], [0.56, 0.305]), [SPRING], None
    )
    assert (
        finding
        == "Missing from the simulation: parallel spring at the knee (probability 0.97). With it"
        " the knee's torque error falls from 2.40 N·m, 8.00 times the noise floor, to 0.30 N·m,"
        " which is noise; the hip's is then 0.56 N·m, 1.12 times its floor."
    )


def test_the_gain_is_given_where_it_is_largest_and_not_where_the_error_is_largest(stuck):
    finding = finding_in_words(
        with_errors(stuck, [0.3, 0.3], [0.9, 0.4], [0.9, 0.305]), [SPRING], None
    )
    assert (
        "the knee's torque error falls from 0.40 N·m, 1.33 times the noise floor, to 0.30 N·m,"
        " which is noise; " in finding
    )
    assert finding.endswith("the hip's is then 0.90 N·m, 3.00 times its floor.")


def test_a_floor_that_no_repetition_shows_is_said_to_be_an_estimate(stuck):
    assert "estimated" not in verdict(stuck)["summary"]
    short = replace(stuck, floor=replace(stuck.floor, from_periods=False))
    estimate = ", so the noise floor is estimated from the band above the motion."
    assert f"No validation run holds two periods{estimate}" in verdict(short)["summary"]
    without_periods = replace(stuck.noise, from_periods=False)
    weighed = replace(stuck, noise=without_periods)
    assert "No training run holds two usable periods" in verdict(weighed)["summary"]
    neither = replace(short, noise=without_periods)
    assert f"No run holds two periods{estimate}" in verdict(neither)["summary"]
    runs = tuple(without_a_period(run) for run in stuck.fitted_runs)
    scheme = replace(stuck.scheme, runs=runs)
    before = replace(stuck.before, runs=[without_a_period(run) for run in stuck.validate])
    summary = verdict(replace(neither, scheme=scheme, before=before))["summary"]
    assert f"No recording names a period{estimate}" in summary


def without_a_period(run):
    return replace(run, motion=replace(run.motion, period_s=None))


def nothing_missing(d, share, from_periods):
    """A diagnosis whose noise floor is so much of each joint's torque, and of which nothing stands
    out."""
    floor = share * d.torque_rms
    noise = Floor(np.append(floor, [np.nan, np.nan]), d.floor.independent_share, from_periods)
    validated = replace(d.before, errors=errors(floor))
    return replace(missing(d, 0.1), floor=noise, before=validated, after=validated)


@pytest.mark.parametrize(("from_periods", "known"), [(False, "is estimated as"), (True, "is")])
def test_a_floor_that_is_most_of_the_torque_is_said_to_hide_what_may_be_missing(
    stuck, from_periods, known
):
    outcome = verdict(nothing_missing(stuck, 0.87, from_periods))
    assert outcome["status"] == "nothing_missing"
    assert "but the floor itself is 87% of the torque and may hide effects." in outcome["finding"]
    assert any(
        f"the noise floor of the hip {known} 87% of its torque" in caveat
        for caveat in outcome["caveats"]
    )


@pytest.mark.parametrize("from_periods", [False, True])
def test_a_floor_of_a_small_share_is_taken_as_it_is(stuck, from_periods):
    outcome = verdict(nothing_missing(stuck, 0.05, from_periods))
    assert outcome["finding"].startswith("Nothing is missing that these data could show")
    assert "floor itself" not in outcome["finding"]
    assert not any("noise floor" in caveat for caveat in outcome["caveats"])


@pytest.mark.parametrize(("times", "reported"), [(1.35, False), (1.5, True)])
def test_where_nothing_is_likely_to_be_missing_most_of_an_error_that_is_not_noise_is_reported(
    stuck, times, reported
):
    silent = nothing_missing(stuck, 0.05, from_periods=True)
    after = replace(silent.after, errors=errors(silent.floor_rms * [times, 1.0]))
    outcome = verdict(replace(silent, before=after, after=after))
    assert outcome["status"] == "nothing_missing"
    assert ("Most of that error is not noise" in outcome["finding"]) == reported
    assert (outcome["residual"] is not None) == reported


@pytest.mark.parametrize(("p", "reported"), [(0.3, True), (0.04, False)])
def test_what_comes_closest_is_said_where_nothing_is_likely_to_be_missing(stuck, p, reported):
    silent = nothing_missing(stuck, 0.05, from_periods=True)
    elements = stuck.selected.posterior.elements
    offset = next(i for i, element in enumerate(elements) if element.label == "torque_offset@knee")
    weighed = Posterior(elements, ((), (offset,)), np.log([1.0 - p, p]))
    finding = verdict(replace(silent, selected=replace(silent.selected, posterior=weighed)))[
        "finding"
    ]
    assert finding.endswith("Torque offset at the knee (0.30) comes closest.") == reported


def test_the_torque_that_an_error_is_of_is_given_on_the_samples_of_the_error(stuck):
    squares = [run.measured[scored(run), :2] ** 2 for run in stuck.validate]
    measured = np.sqrt(np.concatenate(squares).mean(axis=0))
    assert list(verdict(stuck)["torque_rms_nm"].values()) == pytest.approx(measured.tolist())


def odds_in_words(d, rival):
    """Return in words how much less likely a torque offset of this probability is than a spring
    with the rest."""
    elements = d.selected.posterior.elements
    spring = elements.index(d.named[0].element)
    offset = next(i for i, element in enumerate(elements) if element.label == "torque_offset@knee")
    log_odds = np.array([0.0, np.log(rival) - np.log1p(-rival) if rival else -np.inf])
    weighed = Posterior(elements, ((spring,), (offset,)), log_odds)
    named = replace(d.named[0], probability=1.0 - rival)
    selected = replace(
        d.selected, posterior=weighed, answer=replace(d.selected.answer, named=(named,))
    )
    sentences = cause_evidence(replace(d, selected=selected), named)
    return [one for one in sentences if "less likely" in one]


@pytest.mark.parametrize(
    ("rival", "times"),
    [(0.024390, "40 times"), (0.2, "4 times"), (1e-4, "over 1000 times"), (0.6, "no"), (0.0, None)],
)
def test_odds_are_those_among_listed_causes_and_beyond_a_thousand_without_a_figure(
    stuck, rival, times
):
    sentences = odds_in_words(stuck, rival)
    wanted = (
        f"the next listed cause in its place, torque offset at the knee, is {times} less likely"
    )
    assert sentences == ([wanted] if times else [])


def test_a_gain_is_what_the_cause_takes_of_the_error_that_the_others_leave(stuck):
    outcome = verdict(stuck)
    gain = outcome["causes"][0]["gain"]
    taken, remaining = gain["rmse_reduction_nm"], outcome["extended_rmse_nm"][gain["joint"]]
    sentence = (
        f"it removes {taken:.2f} of {remaining + taken:.2f} N·m of torque error at the"
        f" {gain['joint']}"
    )
    assert outcome["causes"][0]["evidence"][0] == f"{sentence} on the validation runs"
    two = replace(stuck.selected.answer, named=stuck.named * 2)
    of_two = cause_evidence(
        replace(stuck, selected=replace(stuck.selected, answer=two)), stuck.named[0]
    )[0]
    assert of_two == f"{sentence} that the other causes leave on the validation runs"


def test_two_causes_are_they_and_a_rest_at_the_worst_joint_is_not_noise(stuck):
    d = with_errors(stuck, [0.5, 0.3], [0.6, 2.4], [0.5, 1.5])
    finding = finding_in_words(d, [SPRING, STRIBECK], None)
    assert "; and Stribeck friction at the hip (probability 0.97). With them the knee's" in finding
    assert finding.endswith("to 1.50 N·m, still 5.00 times the floor.")


def test_a_gain_that_may_be_chance_is_reported_so(stuck):
    assert "may be chance" not in verdict(stuck)["summary"]
    outcome = verdict(without_gain(stuck, 1.0))
    assert "whose gain may be chance. With it" in outcome["summary"]
    assert (
        "that gain may be chance: its 95 % interval includes zero"
        in outcome["causes"][0]["evidence"]
    )


def test_a_gain_that_is_plainly_negative_is_not_called_chance(stuck):
    outcome = verdict(without_gain(stuck, 0.9))
    assert outcome["causes"][0]["gain"]["ci95"][1] < 0.0
    assert "which raises the error on the validation runs. With it" in outcome["summary"]
    assert "that is no gain: its 95 % interval lies below zero" in outcome["causes"][0]["evidence"]
    assert outcome["causes"][0]["evidence"][0].startswith("it removes nothing of ")
    assert not any(
        "chance" in sentence for sentence in (outcome["summary"], *outcome["causes"][0]["evidence"])
    )


@pytest.mark.parametrize(("knee", "reported"), [(1.9, False), (2.5, True)])
def test_a_cause_that_does_not_help_its_own_joint_is_said_not_to(stuck, knee, reported):
    finding = finding_in_words(
        with_errors(stuck, [0.5, 0.3], [0.9, 2.4], [0.5, knee]), [SPRING], None
    )
    assert ("At the knee, where a cause is named, the error does not fall." in finding) == reported


def test_an_error_that_grows_is_not_said_to_fall(stuck):
    finding = finding_in_words(
        with_errors(stuck, [0.5, 0.3], [0.9, 2.4], [1.5, 2.5]), [SPRING], None
    )
    assert "error rises from 2.40 N·m" in finding and "falls" not in finding


def test_of_tied_causes_the_first_is_what_was_fitted(stuck):
    tied = SPRING.model_copy(update={"indistinguishable_from": [TILT]})
    d = with_errors(stuck, [0.5, 0.3], [0.6, 2.4], [0.5, 0.3])
    assert "(together 0.97). With the first of them the knee's" in finding_in_words(d, [tied], None)


def test_ties_are_one_answer_with_one_probability():
    tied = SPRING.model_copy(update={"indistinguishable_from": [TILT]})
    assert (
        _in_words(tied)
        == "parallel spring at the knee or base tilt, which these data cannot separate (together"
        " 0.97)"
    )


@pytest.mark.parametrize(
    ("names", "length", "reported"),
    [
        (("shoulder", "elbow"), None, True),
        (("shoulder", "elbow"), 0.3, False),
        (("hip", "knee"), None, False),
    ],
)
def test_an_arm_without_a_given_length_has_an_exoskeletons(names, length, reported):
    geometry = Geometry() if length is None else Geometry(thigh_length_m=length)
    machine = machine_of([Joint(name) for name in names], geometry)
    run = SimpleNamespace(motion=SimpleNamespace(geometry=geometry))
    diagnosis = SimpleNamespace(baseline=SimpleNamespace(machine=machine), fitted_runs=[run])
    caveats_now = _default_length(diagnosis)
    assert bool(caveats_now) == reported
    assert (
        not reported
        or "0.38952 m is assumed, an exoskeleton's: set geometry.thigh_length_m" in caveats_now[0]
    )


def test_a_shape_that_ended_where_its_search_ends_is_reported_with_its_value():
    effect = PassiveJointTorque(joint="knee")
    least, greatest = reach(effect.shape[0])
    assert least < effect.shape[0].typical[0] and greatest > effect.shape[0].typical[1]

    def caveats_of(onset):
        fit = SimpleNamespace(causes=(Candidate(effect, ((onset, 0.1),)),))
        return _at_ends(SimpleNamespace(after=SimpleNamespace(fit=fit)))

    assert caveats_of(0.2) == []
    (caveat,) = caveats_of(least)
    assert (
        f"passive_joint_torque@knee ended at the limit of its search, onset_angle = {least:.3g} rad"
        in caveat
    )


@pytest.mark.parametrize(("times", "reported"), [(1.0, False), (1e6, True)])
def test_a_size_that_may_be_zero_is_said_not_to_be_determined(stuck, times, reported):
    wide = replace(stuck.uncertainty, covariance=times * stuck.uncertainty.covariance)
    caveats_now = [
        caveat
        for caveat in caveats(replace(stuck, uncertainty=wide))
        if "do not determine" in caveat
    ]
    sentence = (
        "the training runs do not determine the size of parallel spring at the knee: its 95 %"
        " interval includes zero"
    )
    assert caveats_now == [sentence] * reported


@pytest.mark.parametrize(
    ("extended", "status"), [(0.514, "explained"), (0.525, "partly_explained")]
)
def test_an_error_that_ends_as_noise_is_explained_however_little_there_was(stuck, extended, status):
    """Of a hip's error of 1.06 times its floor, 45 % or 83 % of what was systematic is left."""
    assert with_errors(stuck, [0.5, 0.3], [0.53, 2.4], [extended, 0.3]).status == status


@pytest.mark.parametrize(("unlisted", "status"), [(0.4, "explained"), (0.6, "partly_explained")])
def test_with_a_likely_unlisted_law_named_causes_explain_a_part(stuck, unlisted, status):
    """Even where they leave little: what is left need not show in the validation runs' error."""
    answer = replace(stuck.selected.answer, unlisted=unlisted)
    d = with_errors(
        replace(stuck, selected=replace(stuck.selected, answer=answer)),
        [0.5, 0.3],
        [0.6, 2.4],
        [0.5, 0.3],
    )
    assert d.status == status
