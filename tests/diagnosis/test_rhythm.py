"""A rhythm of the motion's own, beside other causes, is no wearer's."""

from dataclasses import replace

import pytest

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.observations import observe
from pipelines.diagnosis.rhythm import shadows_motion
from pipelines.effects import EncoderOffset, VoluntaryTorque
from tests.diagnosis.sessions import session

OFFSET = EncoderOffset(joint="hip")
PUSH = VoluntaryTorque(joint="hip")


@pytest.fixture(scope="module")
def runs():
    return [observe(motion) for motion in session(seconds=40.0)[::2]]


def causes(runs, frequency_hz, *more):
    return [Candidate(effect, (shape,) * len(runs)) for effect, shape in ((PUSH, (frequency_hz,)), *more)]


@pytest.mark.parametrize("frequency_hz", [0.1, 0.4, 1.0005, 2.4])
def test_a_rhythm_at_a_multiple_of_the_motions_mends_the_form_of_other_causes(runs, frequency_hz):
    assert shadows_motion(causes(runs, frequency_hz, (OFFSET, (0.05,))), runs)
    assert not shadows_motion(causes(runs, frequency_hz), runs), "alone a wearer may have fallen in with the machine"


@pytest.mark.parametrize("frequency_hz", [0.13, 0.405, 1.01, 2.55])
def test_a_rhythm_between_multiples_of_the_motions_is_the_wearers_own(runs, frequency_hz):
    assert not shadows_motion(causes(runs, frequency_hz, (OFFSET, (0.05,))), runs)


def test_a_motion_that_does_not_repeat_has_no_multiples(runs):
    once = [replace(run, motion=replace(run.motion, period_s=None)) for run in runs]
    assert not shadows_motion(causes(once, 0.4, (OFFSET, (0.05,))), once)


def test_other_causes_have_no_rhythm(runs):
    assert not shadows_motion(
        [Candidate(OFFSET, ((0.05,),) * 2), Candidate(EncoderOffset(joint="knee"), ((0.1,),) * 2)], runs
    )
