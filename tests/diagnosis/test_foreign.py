"""What no cause of exoid's makes: said to be unknown, and no cause is named that takes next to
nothing of it."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import driven


def verdict_of(kind, more):
    tables = [
        driven(purpose, seed, kind, more, news=0.02)
        for seed, purpose in ((1, "train"), (2, "train"), (3, "validate"))
    ]
    motions = [motion_from_table(motion_table(table, FilterSettings())) for table in tables]
    return verdict(diagnose([replace(m, file=f"{i}.parquet") for i, m in enumerate(motions)]))


def rough_on_one_side(t, q, dq, ddq, own):
    """A bearing that is worn beyond 0.1 rad: loud where the load changes sign, too, as play would
    be."""
    return 1.0 * (q > 0.1) * np.tanh(dq / 0.02)


def held_back(t, q, dq, ddq, own):
    """A transmission whose torque lags behind by up to 0.2 N·m, as magnets and rubber do."""
    lag = np.zeros_like(own)
    for k, step in enumerate(np.diff(own), start=1):
        lag[k] = lag[k - 1] + 0.8 * (step - abs(step) * lag[k - 1] / 0.2)
    return lag


def off_by_a_little(share, own):
    """A current that is read too small where it is large, by up to a share."""
    return -share * own * (own / np.abs(own).max()) ** 2


def gripped_beyond_a_speed(t, q, dq, ddq, own):
    """A damper with a dead zone. Over a Coulomb friction that gives energy Stribeck's law bends so,
    too."""
    return 20.0 * np.sign(dq) * np.maximum(np.abs(dq) - 1.0, 0.0)


def steeper_than_squared(t, q, dq, ddq, own):
    """A drag that rises faster than with the square of speed."""
    return 0.2 * np.sign(dq) * np.abs(dq) ** 2.6


PEAK = "a Stribeck peak of probability 0.50 is named with a drag of another exponent than ours"


@pytest.mark.parametrize(
    "kind",
    [
        "revolute",
        pytest.param(
            "prismatic",
            marks=[pytest.mark.xfail(strict=True, reason=PEAK), pytest.mark.slow],
        ),
    ],
)
def test_what_a_cause_of_another_form_leaves_is_reported_with_its_variable(kind):
    outcome = verdict_of(kind, steeper_than_squared)
    (joint,) = outcome["unexplained"]
    assert (
        outcome["status"] == "explained"
        and outcome["extended_rmse_nm"][joint] > 1.1 * outcome["noise_floor_nm"][joint]
    )
    assert outcome["residual"]["depends_on"][0]["variable"] == "speed"
    assert (
        f"of the remaining error at the {joint} depends on the {joint}'s speed"
        in outcome["summary"]
    )


@pytest.mark.slow
@pytest.mark.xfail(
    strict=True, reason="a wide Stribeck peak is named where friction falls away from zero"
)
@pytest.mark.parametrize("kind", ["revolute", pytest.param("prismatic", marks=pytest.mark.slow)])
def test_no_friction_is_an_excess_over_one_that_gives_energy(kind):
    outcome = verdict_of(kind, gripped_beyond_a_speed)
    named = {cause["effect"] for cause in outcome["causes"]}
    assert named <= {"quadratic_drag"} and outcome["status"] != "nothing_missing"
    assert outcome["residual"]["depends_on"][0]["variable"] == "speed"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_bearing_that_is_rough_on_one_side_is_no_play(kind):
    outcome = verdict_of(kind, rough_on_one_side)
    assert [cause["effect"] for cause in outcome["causes"]] == ["position_dependent_friction"]
    assert outcome["status"] == "partly_explained", "its equation has no step"


def test_a_lifts_weight_hides_nothing_for_what_is_off_varies_with_the_force():
    """Of the whole force it is within what a good rig leaves, for most of it is a weight that never
    changes."""
    outcome = verdict_of("prismatic", held_back)
    error, floor, force = (
        outcome[key]["carriage"] for key in ("baseline_rmse_nm", "noise_floor_nm", "torque_rms_nm")
    )
    assert np.sqrt(error**2 - floor**2) < 0.015 * force
    assert outcome["status"] == "unknown_cause"
    assert "depends on the force that the carriage passes on" in outcome["summary"]


@pytest.mark.parametrize(
    ("share", "status", "words"),
    [(0.015, "nothing_missing", []), (0.03, "unknown_cause", ["a law of the arm's load"])],
)
def test_a_reading_off_by_some_percent_is_a_law_of_the_load_and_half_of_it_is_as_on_a_good_rig(
    share, status, words
):
    outcome = verdict_of("revolute", lambda t, q, dq, ddq, own: off_by_a_little(share, own))
    assert (outcome["status"], outcome["causes"]) == (status, [])
    assert [finding["words"] for finding in outcome["findings"]] == words
    (error,), (torque,) = (outcome[key].values() for key in ("baseline_rmse_nm", "torque_rms_nm"))
    assert error < 0.02 * torque


def test_a_lift_of_which_nothing_is_hidden_misses_nothing():
    outcome = verdict_of("prismatic", lambda t, *motion: np.zeros_like(t))
    assert outcome["status"] == "nothing_missing"


def test_a_drift_at_a_lift_is_reported_by_its_rate_and_its_weight_stays_its_own():
    """Where a force that never changes is the weight's, a further level could be anything."""
    outcome = verdict_of("prismatic", lambda t, *motion: 0.02 * t)
    (cause,) = outcome["causes"]
    rate, level = cause["parameters"]
    assert cause["effect"] == "torque_drift" and rate["value"] == pytest.approx(0.4, rel=0.05)
    assert level["value"] == 0.0 and cause["each_run"] == []
