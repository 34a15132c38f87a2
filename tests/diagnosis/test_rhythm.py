"""A rhythm of the motion's own, beside other causes, is no wearer's."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.observations import observe
from pipelines.diagnosis.rhythm import shadows_motion
from pipelines.effects import EncoderOffset, VoluntaryTorque
from pipelines.model import ParameterLayout
from tests.diagnosis.sessions import session

OFFSET = EncoderOffset(joint="hip")
PUSH = VoluntaryTorque(joint="hip")


@pytest.fixture(scope="module")
def runs():
    return [observe(motion) for motion in session(seconds=40.0)[::2]]


def explained(runs, frequency_hz, *more, left=1.0):
    """A fit of a rhythm and other causes, and what it is held against: an error of three times the floor."""
    made = [Candidate(effect, (shape,) * len(runs)) for effect, shape in ((PUSH, (frequency_hz,)), *more)]
    rms = np.array([left, 1.0, 1.0, 1.0])
    layout = ParameterLayout.of([cause.effect for cause in made], [run.motion.run for run in runs])
    fit = Fit(tuple(made), np.zeros(1), np.ones(4), rms, 0.0, layout, np.zeros((4, 1)), np.eye(1))
    return fit, np.array([3.0, 1.0, 1.0, 1.0]), np.ones(4), runs


@pytest.mark.parametrize("frequency_hz", [0.1, 0.4, 1.0005, 2.4])
def test_a_rhythm_at_a_multiple_of_the_motions_mends_the_form_of_other_causes(runs, frequency_hz):
    assert shadows_motion(*explained(runs, frequency_hz, (OFFSET, (0.05,))))
    assert not shadows_motion(*explained(runs, frequency_hz)), "alone a wearer may have fallen in with the machine"
    assert shadows_motion(*explained(runs, frequency_hz, left=2.8)), "and not where it explains a little of all"


@pytest.mark.parametrize("frequency_hz", [0.13, 0.405, 1.01, 2.55])
def test_a_rhythm_between_multiples_of_the_motions_is_the_wearers_own(runs, frequency_hz):
    assert not shadows_motion(*explained(runs, frequency_hz, (OFFSET, (0.05,))))
    assert not shadows_motion(*explained(runs, frequency_hz, left=2.8))


def test_a_motion_that_does_not_repeat_has_no_multiples(runs):
    once = [replace(run, motion=replace(run.motion, period_s=None)) for run in runs]
    assert not shadows_motion(*explained(once, 0.4, (OFFSET, (0.05,))))
