"""Which samples of a recording are believed, and in which output."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.evidence.baseline import baseline_of, only_trained_outputs
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.fit.joint_fit import fit, residuals_on
from pipelines.estimation.regression import away_from_turns
from pipelines.mechanics.slow_motion import below
from pipelines.model import Model
from tests.diagnosis.sessions import session


@pytest.fixture(scope="module")
def motions():
    return session(seconds=40.0)


def test_near_a_turn_of_either_joint_no_cuff_is_used(motions):
    worn = motions[3]
    steady = away_from_turns(worn)
    turns = [worn.time[np.flatnonzero(np.diff(dq > 0)) + 1] for dq in worn.dq.T]
    for at in np.concatenate(turns):
        near = np.abs(worn.time - at) < 0.065
        assert not steady[near].any()
    distance = np.min(np.abs(worn.time[:, np.newaxis] - np.concatenate(turns)), axis=1)
    assert steady[distance > 0.085].all()


def test_cuffs_measure_the_wearers_torque_better_away_from_turns_than_near_them(motions):
    run = observe(motions[3])
    baseline = baseline_of([run])
    fitted = fit([], [run], baseline, np.array([1.0, 1.0, 10.0, 10.0]))
    residual = residuals_on(fitted, [run], baseline)[0][:, 2]
    steady = run.usable[:, 2]
    assert np.mean(residual[run.valid & ~steady] ** 2) > np.mean(residual[steady] ** 2)


def in_turns(motion, every=4):
    """The same run from sensors that take turns, each read once in so many samples."""
    forces = np.full_like(motion.forces, np.nan)
    for cuff in range(4):
        forces[cuff % every :: every, cuff] = motion.forces[cuff % every :: every, cuff]
    return replace(motion, forces=forces)


def test_sensors_that_are_read_in_turns_measure_the_same_torque(motions):
    whole, thin = observe(motions[3]), observe(in_turns(motions[3]))
    assert thin.has_cuffs
    both = thin.usable[:, 2:]
    assert both.sum() > 0.98 * whole.usable[:, 2:].sum()
    apart = (thin.measured - whole.measured)[:, 2:][both]
    assert np.sqrt(np.mean(apart**2)) < 0.05 * whole.measured[:, 2:][both].std()


def test_sensors_that_are_read_too_seldom_measure_no_torque(motions):
    assert not observe(in_turns(motions[3], every=30)).has_cuffs


def test_a_validation_run_has_no_cuffs_where_training_had_none(motions):
    trained = observe(replace(motions[2], forces=None))
    validated = observe(motions[3])
    baseline = baseline_of([trained])
    assert validated.has_cuffs
    assert not only_trained_outputs(validated, baseline).has_cuffs
    assert only_trained_outputs(validated, baseline_of([validated])) is validated


def test_torque_of_the_model_obeys_it_behind_the_low_pass_but_not_along_a_low_passed_motion(
    motions,
):
    """Friction turns round at once, centrifugal torque is a square: a filtered motion has them
    bent."""
    motion = motions[0]
    baseline = baseline_of([observe(motion)])
    values = np.linspace(1.0, 3.0, baseline.size)
    model = Model(baseline.terms)
    torque = model.regressor(motion) @ values
    residuals = {}
    for name, moved in (("low-pass", motion), ("motion", below(motion, 5.0))):
        run = observe(replace(motion, torque=torque), cutoff_hz=5.0)
        predicted = run.average(model.regressor(moved, cuffs=True) @ values)
        residuals[name] = (run.measured - predicted)[run.usable[:, 0], 0]
    assert np.abs(residuals["low-pass"]).max() < 1e-9
    assert np.sqrt(np.mean(residuals["motion"] ** 2)) > 0.01


def test_what_is_bad_is_not_trusted_as_far_as_the_low_pass_carries_it(motions):
    motion = motions[0]
    valid = motion.valid.copy()
    valid[2000] = False
    spoilt = replace(motion, valid=valid)
    near = np.abs(observe(spoilt).time - motion.time[2000]) < 0.25
    assert not observe(spoilt, cutoff_hz=5.0).valid[near].any()
    assert observe(spoilt).valid[near].sum() == near.sum() - 1
