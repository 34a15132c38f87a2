"""A torque sensor that is tared at every start: each run has an offset of its own, and no drift is
claimed.

What is hidden is added to recorded torques, by no code of the effects'.
"""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.verdict import EffectAtJoint
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import banded, session
from tests.diagnosis.test_each_run import zeroed

HIDDEN = {"run_0.parquet": 1.1, "run_1.parquet": -0.8, "run_2.parquet": -0.9, "run_3.parquet": 0.7}
"""N·m, at the knee; runs 1 and 3 are of those that no fit sees."""
EVERY = dict.fromkeys(HIDDEN, 1.0)


def misread(motion, offset, rate=0.0):
    """Return a motion whose knee torque was read ``offset`` N·m too high, and by ``rate`` N·m/s
    more as it went on."""
    more = offset + rate * (motion.time - motion.time[0])
    return replace(motion, torque=motion.torque + more[:, np.newaxis] * np.array([0.0, 1.0]))


def verdict_of(offsets, rate=0.0, seed=1, seconds=30.0):
    runs = session(seconds=seconds, seed=seed)
    return verdict(diagnose([misread(m, offsets[m.file], rate) for m in runs]))


@pytest.fixture(scope="module")
def tared():
    return verdict_of(HIDDEN, seconds=20.0)


def test_a_sensor_tared_at_each_start_is_named_and_only_a_drift_that_hardly_grows_ties(
    tared,
):
    assert tared["status"] == "explained"
    (cause,) = tared["causes"]
    names = {
        EffectAtJoint.model_validate(one).label for one in (cause, *cause["indistinguishable_from"])
    }
    assert "torque_offset@knee" in names and names <= {"torque_offset@knee", "torque_drift@knee"}
    assert "per-run torque offset at the knee" in tared["summary"]
    rates = [p for p in cause["parameters"] if p["name"] == "rate"]
    assert all(p["ci95"][0] < 0.0 < p["ci95"][1] for p in rates), (
        "a drift that does not grow is an offset of each run"
    )
    assert cause["fitted_on_validate"] == (["level"] if rates else ["offset"])


def test_each_run_s_own_offset_is_recovered_and_its_interval_holds_it(tared):
    (cause,) = tared["causes"]
    (own,) = cause["fitted_on_validate"]
    assert {one["file"]: one["values"][own] for one in cause["each_run"]} == pytest.approx(
        HIDDEN, abs=0.08
    )
    for one in cause["each_run"]:
        if one["purpose"] == "train":
            low, high = one["ci95"][own]
            assert low <= HIDDEN[one["file"]] <= high and high - low < 0.3


@pytest.mark.slow
def test_one_offset_in_all_runs_is_one_and_no_run_has_another():
    outcome = verdict_of(EVERY)
    (cause,) = outcome["causes"]
    # While the joint always moves, friction that differs with direction is the same torque.
    names = {cause["effect"], *(tie["effect"] for tie in cause["indistinguishable_from"])}
    assert {"torque_offset", "coulomb_asymmetry"} <= names
    assert cause["each_run"] == [] and "per-run" not in outcome["summary"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "levels",
    [HIDDEN, pytest.param(dict.fromkeys(HIDDEN, 0.0), marks=pytest.mark.slow)],
    ids=["tared", "settled"],
)
def test_what_grows_within_runs_is_a_drift_whatever_its_level(levels):
    outcome = verdict_of(levels, rate=0.03)
    (cause,) = outcome["causes"]
    assert EffectAtJoint.model_validate(cause).label == "torque_drift@knee"
    assert "torque_offset" not in [tie["effect"] for tie in cause["indistinguishable_from"]]
    rate = next(p for p in cause["parameters"] if p["name"] == "rate")
    assert rate["ci95"][0] <= 0.03 <= rate["ci95"][1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 20))
def test_of_a_sensor_that_is_right_nothing_is_named(seed):
    outcome = verdict_of(dict.fromkeys(HIDDEN, 0.0), seed=seed)
    assert outcome["status"] == "nothing_missing" and outcome["causes"] == []


def two_runs(spoil, offsets):
    """The verdict on one run to train and one to validate, each with an offset of its own."""
    runs = session(seconds=30.0)[2:]
    return verdict(diagnose([spoil(m, offset) for m, offset in zip(runs, offsets, strict=True)]))


def set_at_each_start(outcome):
    """Return the caveats that one training run cannot show a zero of each run's own."""
    return [caveat for caveat in outcome["caveats"] if "set at each start" in caveat]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "offsets", "names"),
    [
        (misread, (1.1, -0.8), {"torque_offset", "torque_drift"}),
        (misread, (0.0, 1.2), {"torque_offset", "torque_drift"}),
        (zeroed, (0.07, -0.06), {"encoder_offset"}),
    ],
    ids=["tared", "validation run only", "zeroed"],
)
def test_of_two_runs_whose_zeros_differ_each_has_its_own_though_one_training_run_cannot_show_it(
    spoil, offsets, names
):
    outcome = two_runs(spoil, offsets)
    (cause,) = outcome["causes"]
    assert outcome["sought_on"] == "all"
    assert {one["effect"] for one in (cause, *cause["indistinguishable_from"])} == names
    (own,) = cause["fitted_on_validate"]
    values = [one["values"][own] for one in cause["each_run"]]
    assert values == pytest.approx(offsets, abs=0.08 if spoil is misread else 0.01)
    assert set_at_each_start(outcome) == []
    assert any(caveat.startswith("causes were sought on all runs") for caveat in outcome["caveats"])


@pytest.mark.slow
def test_of_two_runs_one_offset_in_both_is_one():
    outcome = two_runs(misread, (1.0, 1.0))
    (cause,) = outcome["causes"]
    # While the joint always moves, friction that differs with direction is the same torque.
    names = {cause["effect"], *(tie["effect"] for tie in cause["indistinguishable_from"])}
    assert {"torque_offset", "coulomb_asymmetry"} <= names
    assert cause["each_run"] == [] and set_at_each_start(outcome) == []


@pytest.mark.slow
def test_where_one_training_run_shows_something_unlisted_it_is_said_what_it_cannot_show():
    outcome = verdict(diagnose(banded(session(seed=5)[2:])))
    assert (outcome["status"], outcome["causes"]) == ("unknown_cause", [])
    assert len(set_at_each_start(outcome)) == 1
