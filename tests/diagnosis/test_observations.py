"""Which samples of a recording are believed, and in which output."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.fit import fit, residuals_on
from pipelines.diagnosis.observations import baseline_of, like_trained, observe
from pipelines.estimation.regression import TURN_S, away_from_turns
from tests.diagnosis.sessions import session


@pytest.fixture(scope="module")
def motions():
    return session(seconds=40.0)


def test_beside_a_turn_of_either_joint_no_cuff_is_believed(motions):
    worn = motions[3]
    steady = away_from_turns(worn)
    turns = [worn.time[np.flatnonzero(np.diff(dq > 0)) + 1] for dq in worn.dq.T]
    for at in np.concatenate(turns):
        near = np.abs(worn.time - at) < TURN_S - 0.01
        assert not steady[near].any()
    distance = np.min(np.abs(worn.time[:, np.newaxis] - np.concatenate(turns)), axis=1)
    assert steady[distance > TURN_S + 0.01].all()


def test_cuffs_tell_the_wearers_torque_better_away_from_turns_than_beside_them(motions):
    run = observe(motions[3])
    baseline = baseline_of([run])
    made = fit([], [run], baseline, np.array([1.0, 1.0, 10.0, 10.0]))
    left = residuals_on(made, [run], baseline)[0][:, 2]
    steady = run.usable[:, 2]
    assert np.mean(left[run.valid & ~steady] ** 2) > np.mean(left[steady] ** 2)


def test_a_validation_run_has_no_cuffs_where_training_had_none(motions):
    trained = observe(replace(motions[2], forces=None))
    validated = observe(motions[3])
    baseline = baseline_of([trained])
    assert validated.has_cuffs
    assert not like_trained(validated, baseline).has_cuffs
    assert like_trained(validated, baseline_of([validated])) is validated
