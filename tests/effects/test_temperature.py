"""What depends on the temperature that a drive records."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.diagnosis.candidates.library import _effects
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.friction_temperature import FrictionTemperature
from pipelines.effects.gain_drift import GainDrift
from pipelines.errors import InputError
from pipelines.identification import Extension, identify
from pipelines.model import Model, Term
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import session

BODY = Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7]))
FRICTION = tuple(Term(Friction(joint), np.array([2.0, 3.0])) for joint in ("hip", "knee"))
PER_DEGREE = np.array([-0.15, -0.08])
AT_REFERENCE = 25.0


def labels(motions):
    runs = [observe(motion) for motion in motions if motion.purpose == "train"]
    return {effect.label for effect in _effects(prepare(runs, baseline_of(runs)))}


@pytest.fixture(scope="module")
def warm_and_cold():
    """A session whose second recording was made with the drives 15 °C warmer."""
    motions = session()
    warmer = {"run_2.parquet": 15.0}
    return [
        replace(m, temperature=m.interpolated_temperature + warmer.get(m.file, 0.0))
        for m in motions
    ]


def test_friction_that_falls_with_temperature_is_recovered_across_runs(with_human):
    """Each run has one temperature: only together do they show what a degree does."""
    rng = np.random.default_rng(5)
    knee = Term(FrictionTemperature("knee"), PER_DEGREE)
    regressors, torques = [], []
    for celsius in (20.0, 27.0, 36.0):
        steady = np.full(with_human.q.shape, celsius)
        motion = replace(with_human, temperature=steady)
        torque = Model((BODY, *FRICTION, knee)).torque(motion)
        torques.append(torque + rng.normal(0.0, 0.5, torque.shape))
        regressors.append(Model((BODY, *FRICTION, knee)).regressor(motion))
    A, y = np.concatenate(regressors), np.concatenate(torques)
    found = np.linalg.lstsq(A.reshape(-1, A.shape[2]), y.ravel(), rcond=None)[0]
    assert_allclose(found[-2:], PER_DEGREE, atol=0.015)
    assert_allclose(found[6:8], [2.0, 3.0], atol=0.2)  # the knee's friction at 25 °C


def test_friction_at_the_reference_temperature_is_the_baselines(with_human):
    motion = replace(with_human, temperature=np.full(with_human.q.shape, AT_REFERENCE))
    assert not FrictionTemperature("knee").torque(motion, PER_DEGREE).any()


def test_what_depends_on_temperature_is_no_candidate_where_none_was_read(warm_and_cold):
    unread = [replace(m, temperature=None) for m in warm_and_cold]
    assert "friction_temperature@knee" in labels(warm_and_cold)
    assert not any(label.startswith("friction_temperature") for label in labels(unread))
    assert "gain_drift@knee" in labels(unread)  # with time


def test_what_depends_on_temperature_is_no_candidate_where_it_stayed_the_same(warm_and_cold):
    steady = [replace(m, temperature=np.full(m.q.shape, 31.0)) for m in warm_and_cold]
    assert not any(label.startswith("friction_temperature") for label in labels(steady))


def test_a_gain_may_follow_the_temperature_only_where_it_was_read(warm_and_cold):
    drift = GainDrift("knee")
    read = drift.directions(warm_and_cold)
    unread = drift.directions([replace(m, temperature=None) for m in warm_and_cold])
    assert set(read) - set(unread) == {((0.0, 0.0, 0.002),)}


def test_readings_that_are_far_apart_are_joined_by_straight_lines(with_human):
    sparse = np.full(with_human.q.shape, np.nan)
    sparse[::100] = with_human.temperature[::100]
    motion = replace(with_human, temperature=sparse)
    assert_allclose(
        motion.interpolated_temperature[:-100], with_human.temperature[:-100], atol=1e-9
    )
    values = PER_DEGREE
    full = FrictionTemperature("knee").torque(with_human, values)
    assert_allclose(FrictionTemperature("knee").torque(motion, values)[:-100], full[:-100])


def test_a_motor_that_was_never_read_explains_nothing(with_human):
    motion = replace(with_human, temperature=with_human.temperature.copy())
    motion.temperature[:, 1] = np.nan
    assert not FrictionTemperature("knee").explains(motion)
    assert FrictionTemperature("hip").explains(motion)


def test_a_gain_whose_temperature_was_not_read_is_that_at_the_reference(with_human):
    ones = np.ones((*with_human.q.shape, 1))
    warm = (0.0, 0.0, 0.01)
    unread = replace(with_human, temperature=None)
    assert_allclose(GainDrift("hip").observed(ones, unread, warm), ones)
    assert GainDrift("hip").observed(ones, with_human, warm)[-1, 0, 0] > 1.05


@pytest.mark.parametrize("time_constant", [0.0, 8.0])
def test_a_gain_drifts_evenly_or_towards_a_limit(with_human, time_constant):
    ones = np.ones((*with_human.q.shape, 1))
    drift = GainDrift("hip")
    measured = drift.observed(ones, with_human, (0.01, time_constant))[:, 0, 0]
    t = with_human.time
    expected = t if time_constant == 0.0 else time_constant * (1.0 - np.exp(-t / time_constant))
    assert_allclose(measured, 1.0 + 0.01 * expected)


def test_a_gain_that_follows_the_temperature_is_recovered_across_runs(warm_and_cold):
    """The column of the candidate is in proportion to what a degree does to the gain."""
    hidden = Term(GainDrift("knee"), np.array([0.0, 0.0, 0.004]))
    motions = [
        replace(
            m,
            torque=hidden.effect.observed(m.torque[:, :, np.newaxis], m, hidden.shape)[:, :, 0],
        )
        for m in warm_and_cold
    ]
    look = Screening.of(motions)
    by_temperature = next(
        fitted
        for fitted in look.fits(GainDrift("knee"))
        if fitted.candidate.directions == ((0.0, 0.0, 0.002),)
    )
    assert_allclose(look.refined(by_temperature), [0.0, 0.0, 0.004], atol=0.001)


def test_an_identification_with_temperature_refuses_runs_without(warm_and_cold):
    known = Extension((Term(FrictionTemperature("knee"), np.zeros(2)),))
    identify(warm_and_cold, extension=known)
    unread = [replace(m, temperature=None) for m in warm_and_cold]
    with pytest.raises(InputError) as caught:
        identify(unread, extension=known)
    assert str(caught.value) == (
        "run_0.parquet: has no column knee_temperature_c, on which friction_temperature@knee"
        " depends. Record the temperature, or leave the effect out"
    )
