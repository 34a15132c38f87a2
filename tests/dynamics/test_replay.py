"""A model under recorded torque: the truth stays on the recording, anything else does not."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.dynamics.replay import replay
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.presliding_hysteresis import PreslidingHysteresis
from pipelines.errors import InputError
from pipelines.model import Model, Term


def test_the_true_model_stays_on_the_recording(leg, recorded):
    assert np.all(replay(leg, recorded).rmse < 1e-4)


def test_a_leg_five_per_cent_too_heavy_leaves_it_a_thousand_times_farther(leg, recorded):
    heavy = Model((Term(RigidBody(), 1.05 * leg.terms[0].values), *leg.terms[1:]))
    assert np.all(replay(heavy, recorded).rmse > 1e3 * replay(leg, recorded).rmse)


@pytest.mark.parametrize(
    ("effect", "values", "largest_rmse"),
    [
        (PreslidingHysteresis("knee"), (2.0, 0.05), 1e-3),
        (JointElasticity("knee"), (800.0,), 3e-3),
        (EncoderOffset("hip"), (0.05,), 1e-4),
    ],
    ids=lambda x: getattr(x, "name", None),
)
def test_an_effect_that_the_leg_has_is_needed_to_stay_on_the_recording(
    leg, record, effect, values, largest_rmse
):
    whole = Model((*leg.terms, Term(effect, np.array(values))))
    motion = record(whole)
    assert np.all(replay(whole, motion).rmse < largest_rmse)
    assert replay(leg, motion).rmse.max() > 5 * replay(whole, motion).rmse.max()


def test_windows_start_every_half_second_in_the_recorded_state(leg, recorded):
    result = replay(leg, recorded)
    assert np.all(np.diff(result.first) == 100)
    assert result.angle.shape == (len(result.first), 201, 2)
    assert_allclose(result.angle[:, 0], recorded.q[result.first])
    assert_allclose(result.rmse, np.sqrt(np.mean(result.error**2, axis=(0, 1))))


def test_no_window_holds_a_gap_or_a_bad_sample(leg, recorded):
    segment, valid = recorded.segment.copy(), recorded.valid.copy()
    segment[900:] = 1
    valid[1500] = False
    result = replay(leg, replace(recorded, segment=segment, valid=valid))
    last = result.first + result.angle.shape[1] - 1
    for bad in (899.5, 1500):
        assert not np.any((result.first <= bad) & (bad <= last))
    assert len(result.first) > 10


def test_terms_of_another_kind_of_run_are_left_out(leg, recorded):
    of_the_wearer = (
        Term(RigidBody(run="with_human"), np.ones(4)),
        Term(Friction("hip", run="with_human"), np.ones(2)),
    )
    more = Model((*leg.terms, *of_the_wearer))
    assert_allclose(replay(more, recorded).rmse, replay(leg, recorded).rmse)


def test_a_recording_shorter_than_a_window_is_refused(leg, recorded):
    with pytest.raises(InputError) as caught:
        replay(leg, recorded, window_s=60.0)
    assert (
        str(caught.value)
        == "the motion: no stretch of valid samples lasts the 60 s of a window; replay a longer"
        " recording without gaps"
    )


def test_a_model_that_diverges_has_no_error(leg, recorded):
    """A shank of nearly no inertia whose friction drives it, as fitted where nothing moves it."""
    light = Term(RigidBody(), np.array([0.9, 1e-4, 1e-4, 2.0]))
    pushed = Term(Friction("knee"), np.array([4.6, -0.28]))
    assert not np.isfinite(replay(Model((light, leg.terms[1], pushed)), recorded).rmse).all()
