"""What each estimator is for, on a pendulum that shares no code with exoid
(tests/estimation/pendulum.py)."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import binom

from pipelines.errors import InputError
from pipelines.estimation import output_error
from pipelines.estimation.durbin_wu_hausman import DurbinWuHausman
from pipelines.estimation.estimator import estimated
from pipelines.estimation.estimators import ESTIMATORS, estimator_named
from pipelines.estimation.instrumental_variables import InstrumentalVariables, _sentence
from pipelines.estimation.iteratively_reweighted import IterativelyReweighted
from pipelines.estimation.least_squares import OrdinaryLeastSquares, WeightedLeastSquares
from pipelines.estimation.output_error import OutputError
from tests.estimation.pendulum import INERTIA, TRUTH, Disturbed, motion, problem

CLEAN, NOISY_ANGLES, STRUCK = Disturbed(), Disturbed(angle_rad=0.002), Disturbed(outliers=0.02)
every_estimator = pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: e.name)


def error(fit):
    return np.sqrt(np.diag(fit.covariance))


@pytest.fixture(scope="module")
def clean():
    return problem(motion(CLEAN, 2))


@pytest.fixture(scope="module")
def struck():
    return problem(motion(STRUCK, 2))


@pytest.fixture(scope="module")
def noisy():
    """Four runs whose encoders are noisy."""
    return problem(*(motion(NOISY_ANGLES, seed) for seed in range(4)))


@every_estimator
def test_all_methods_find_the_truth_on_clean_data_and_agree(clean, estimator):
    found = estimated(estimator().fit(clean))
    assert np.all(np.abs(found.values - TRUTH) < 4.0 * error(found))
    least_squares = estimated(WeightedLeastSquares().fit(clean))
    both = np.hypot(error(found), error(least_squares))
    assert np.all(np.abs(found.values - least_squares.values) < 2.0 * both)


@pytest.mark.parametrize(
    "estimator", [e for e in ESTIMATORS if e is not OutputError], ids=lambda e: e.name
)
def test_held_friction_is_carried_as_a_fit_with_other_friction_says(clean, estimator):
    """How the rigid body answers to friction that is held is what it would be found as under other
    friction."""
    one, other, foretold = under_other_friction(estimator(), clean, 0.02)
    assert_allclose(
        other.values - one.values, foretold, rtol=0.3, atol=0.02 * np.max(np.abs(foretold))
    )
    assert np.all(one.carry[:, :2] == 0.0)


def test_held_friction_is_carried_by_output_error_to_within_where_its_search_ends(clean):
    """A joint that sticks a moment longer makes the error jump: no search ends nearer than a share
    of its interval."""
    one, other, foretold = under_other_friction(OutputError(), clean, 0.2)
    assert np.all(np.abs(other.values - one.values - foretold) < 0.5 * error(one))
    assert np.all(np.sign(other.values - one.values) == np.sign(foretold))


def under_other_friction(estimator, clean, change):
    changed = np.array([0.0, 0.0, change, -change])
    held = replace(clean, fitted=np.array([0, 1]), held=TRUTH)
    one, other = (estimated(estimator.fit(p)) for p in (held, replace(held, held=TRUTH + changed)))
    return one, other, one.carry @ changed


def test_one_joint_alone_weighs_nothing(clean):
    ordinary, weighted = OrdinaryLeastSquares().fit(clean), WeightedLeastSquares().fit(clean)
    assert_allclose(ordinary.values, weighted.values, rtol=1e-9)


def test_outliers_that_shift_least_squares_leave_the_robust_fit_where_it_was(clean, struck):
    least_squares, robust = (
        estimated(e.fit(struck)) for e in (WeightedLeastSquares(), IterativelyReweighted())
    )
    before = estimated(IterativelyReweighted().fit(clean))
    coulomb = 2
    assert least_squares.values[coulomb] > 1.2 * TRUTH[coulomb]
    assert np.all(np.abs(robust.values - TRUTH) < 4.0 * error(robust))
    # It costs the blocks that are struck, a tenth of them, and little more.
    assert np.all(error(robust) < 1.5 * error(before))
    assert np.all(error(robust) < 0.6 * error(least_squares))
    share = robust.about["rejected_share"]["joint"]
    assert 0.5 * 0.096 < share < 1.5 * 0.096, (
        "a block has five samples, each of which may be struck"
    )
    assert any("are ignored" in remark for remark in robust.remarks)


def test_noise_in_the_angles_biases_least_squares_and_not_instrumental_variables(noisy):
    least_squares, instruments = (
        estimated(e.fit(noisy)) for e in (WeightedLeastSquares(), InstrumentalVariables())
    )
    inertia = 0
    assert least_squares.values[inertia] < TRUTH[inertia] - 4.0 * error(least_squares)[inertia]
    assert least_squares.values[inertia] < 0.95 * INERTIA
    assert np.all(np.abs(instruments.values - TRUTH) < 3.5 * error(instruments))
    (sentence,) = instruments.remarks
    assert sentence.startswith("noise in the angles biases least squares (Durbin-Wu-Hausman F(4, ")
    assert "X1 most: least squares has it -" in sentence


@pytest.mark.parametrize(
    ("size", "begins"), [(1e-3, "noise in the angles shows"), (1.0, "noise in the angles biases")]
)
def test_a_bias_that_is_sure_and_slight_is_said_not_to_matter(noisy, size, begins):
    """As in a long recording by a good encoder: the test sees what no interval shows."""
    fit = InstrumentalVariables().fit(noisy)
    off = size * np.abs(fit.values)
    test = DurbinWuHausman(off, off / 10.0, 30.0, (4.0, 300.0), 1e-9)
    sentence = _sentence(test, noisy.names, fit)
    assert sentence.startswith(begins) and ("does not matter" in sentence) == (size < 1.0)


def test_output_error_does_without_the_acceleration_that_noise_spoils(noisy):
    least_squares, output = (e.fit(noisy).values for e in (WeightedLeastSquares(), OutputError()))
    inertia = 0
    assert abs(output[inertia] / INERTIA - 1.0) < 0.25 * abs(least_squares[inertia] / INERTIA - 1.0)


def false_alarms(sessions):
    """How often good angles are called noisy, and by how sure a test: torque noise of three
    colours."""
    told = []
    for seed in range(sessions):
        noise = Disturbed(correlation_s=(0.0005, 0.02, 0.2)[seed % 3])
        fit = InstrumentalVariables().fit(problem(motion(noise, seed)))
        told.append(fit.about["durbin_wu_hausman"]["p_value"])
    return np.array(told)


@pytest.mark.slow
def test_good_angles_are_seldom_called_noisy():
    sessions = 30
    alarms = int(np.sum(false_alarms(sessions) < 0.05))
    assert alarms <= binom.ppf(0.999, sessions, 0.05)


@pytest.mark.slow
def test_good_angles_are_called_noisy_at_the_nominal_rate():
    p = false_alarms(600)
    print(
        f"\nfalse alarms at 5 %: {100 * np.mean(p < 0.05):.1f} %, at 20 %:"
        f" {100 * np.mean(p < 0.2):.1f} %"
    )
    assert 0.025 < np.mean(p < 0.05) < 0.08
    assert 0.14 < np.mean(p < 0.2) < 0.27


def test_unknown_drives_are_replaced_by_a_model_based_loop(noisy):
    silent = problem(
        *(replace(run, metadata={**run.metadata, "controller": {}}) for run in noisy.training.runs)
    )
    told, untold = (estimated(InstrumentalVariables().fit(p)) for p in (noisy, silent))
    assert np.all(np.abs(untold.values - TRUTH) < 3.5 * error(untold))
    assert np.all(np.abs(untold.values - told.values) < 2.0 * error(told))


def test_without_set_points_there_are_no_instruments(clean):
    (run,) = clean.training.runs
    with pytest.raises(
        InputError, match=r"^run.parquet: has no set-points of the joint, which a simulation of its"
    ):
        InstrumentalVariables().fit(problem(replace(run, reference=None, file="run.parquet")))


def test_set_points_that_come_seldom_are_joined_by_lines(clean):
    (run,) = clean.training.runs
    seldom = run.reference.copy()
    seldom[np.arange(len(seldom)) % 2 == 1] = np.nan
    often, thinned = (
        estimated(InstrumentalVariables().fit(problem(r)))
        for r in (run, replace(run, reference=seldom))
    )
    assert np.all(np.abs(thinned.values - often.values) < 0.1 * error(often))


def test_an_unknown_method_is_refused_with_the_nearest_name():
    with pytest.raises(
        InputError,
        match="there is no method 'instrumental_variable'; did you mean instrumental_variab",
    ):
        estimator_named("instrumental_variable")


@pytest.mark.parametrize(
    ("short", "method"),
    [
        ("iv", InstrumentalVariables),
        ("wls", WeightedLeastSquares),
        ("ols", OrdinaryLeastSquares),
        ("irls", IterativelyReweighted),
        ("oe", OutputError),
    ],
)
def test_a_method_answers_to_what_papers_call_it_for_short(short, method):
    assert type(estimator_named(short)) is method


STEPPED = 9
"""The simulation that tries the search's first step: one for the weights, one to count, one at the
start, five and one for the slopes there."""


def test_output_error_takes_back_a_step_to_a_machine_without_inertia(clean, monkeypatch):
    """Such a machine has no motion to be held against the recorded one."""
    replayed, calls = output_error.replay, []

    def without_inertia_once(*arguments):
        calls.append(1)
        if len(calls) == STEPPED:
            raise ZeroDivisionError
        return replayed(*arguments)

    undisturbed = OutputError().fit(clean)
    monkeypatch.setattr(output_error, "replay", without_inertia_once)
    found = OutputError().fit(clean)
    assert len(calls) > STEPPED
    assert np.all(np.abs(found.values - undisturbed.values) < 0.5 * error(estimated(undisturbed)))
