"""What counts as missing physics, what as noise, and what cuffs and drives share."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import Candidate, lowest
from pipelines.diagnosis.candidates.shape_refinement import changed, free_shapes
from pipelines.diagnosis.evidence.baseline import baseline_of, with_load
from pipelines.diagnosis.evidence.cuff_coherence import cuff_coherence
from pipelines.diagnosis.evidence.motion_band import above_the_motion_hz
from pipelines.diagnosis.evidence.observed_run import FOLDS, observe
from pipelines.diagnosis.evidence.slow_error import slow_error
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.effects import Cogging, VoluntaryTorque
from tests.diagnosis.sessions import session

NOISE = 0.5


@pytest.fixture(scope="module")
def motions():
    return session(seconds=40.0)


@pytest.fixture(scope="module")
def run(motions):
    observed = observe(motions[1])
    baseline = baseline_of([observed])
    values = np.zeros(baseline.size)
    values[:4] = 1.5, 0.2, 0.4, 2.0
    return with_load(observed, baseline, values)


@pytest.fixture(scope="module")
def worn(motions):
    return observe(motions[3])


def noise(run, seed=0):
    return np.random.default_rng(seed).normal(size=run.measured.shape) * NOISE


def sureness(slow):
    """Return the systematic power in standard errors of the floor's, (O,)."""
    return ((slow.rms / slow.floor) ** 2 - 1.0) / np.sqrt(2.0 / np.maximum(slow.independent, 1.0))


def test_noise_alone_has_no_systematic_error(run):
    slow = slow_error([run], [noise(run)])
    assert np.all(np.abs(sureness(slow)[:2]) < 3.5)
    assert np.all(slow.excess[:2] < 0.25 * NOISE)


def test_slow_error_that_repeats_is_systematic_and_fast_error_that_repeats_is_not(run):
    phase = 2 * np.pi * run.time / run.motion.period_s
    for harmonic, systematic in ((5, True), (150, False)):
        repeated = 0.4 * np.sin(harmonic * phase)[:, np.newaxis]
        slow = slow_error([run], [noise(run) + repeated])
        assert (slow.excess[0] > 0.2) == systematic
        assert (sureness(slow)[0] > 3.5) == systematic


def test_what_moves_fast_has_lines_further_up(run):
    time = np.arange(len(run.motion.dq)) / run.motion.sample_rate_hz
    swinging = np.column_stack([np.sin(2 * np.pi * 2.5 * time), np.sin(2 * np.pi * 1.1 * time)])
    fast = replace(run, motion=replace(run.motion, dq=swinging))
    assert above_the_motion_hz(run) < 4.3 < above_the_motion_hz(fast) < 8.9


def bursts(run, seed=3):
    """A push of half a second every three seconds or so, at instants of its own."""
    starts = np.cumsum(np.random.default_rng(seed).exponential(3.0, 40))
    return 1.5 * sum(np.exp(-(((run.time - at) / 0.5) ** 2)) for at in starts)


def test_a_push_is_detected_where_cuffs_and_drive_scatter_alike_and_only_at_its_joint(worn):
    push = bursts(worn)[:, np.newaxis] * np.array([0.0, 1.0, 0.0, 1.0])
    quiet = noise(worn) * np.array([1.0, 1.0, 0.2, 0.2])
    gains = cuff_coherence([worn], [quiet + push])
    assert gains[1] > 6.0
    assert gains[0] == 0.0


def test_a_drag_of_the_machines_own_and_noise_are_no_push(worn):
    quiet = noise(worn) * np.array([1.0, 1.0, 0.2, 0.2])
    drag = bursts(worn)[:, np.newaxis] * np.array([0.0, 1.0, 0.0, 0.0])
    assert np.all(cuff_coherence([worn], [quiet + drag]) == 0.0)
    repeated = np.sin(2 * np.pi * 5 * worn.time / worn.motion.period_s)[:, np.newaxis]
    assert np.all(cuff_coherence([worn], [quiet + repeated]) == 0.0), (
        "a spring on the limb repeats with the motion"
    )
    silent = [
        cuff_coherence([worn], [noise(worn, seed) * np.array([1, 1, 0.2, 0.2])])
        for seed in range(20)
    ]
    assert np.all(np.array(silent) == 0.0)


def test_a_step_of_the_refinement_stays_at_the_maximum_that_the_search_found():
    rhythm = Candidate(VoluntaryTorque(joint="hip"), ((0.43,),))
    ((i, unit),) = free_shapes(rhythm)
    for step in (-50.0, 50.0):
        assert changed(rhythm, i, unit, step).shapes[0][0] == pytest.approx(0.43, abs=0.01)


def test_a_run_shorter_than_its_period_is_still_dealt_out_to_every_fold(run):
    short = observe(replace(run.motion, period_s=300.0))
    assert set(short.fold) == set(range(FOLDS))


def test_a_wave_that_does_not_come_again_within_the_motion_is_no_cogging(run):
    baseline, ripple = baseline_of([run]), Cogging(joint="knee")
    angle = run.state[0][:, 1]
    measured = run.measured.copy()
    measured[:, 1] += 5.0 * np.sin(2.0 * np.pi * (angle - angle.min()) / np.ptp(angle))
    runs = [replace(run, measured=measured)]
    least = lowest(ripple, ripple.shape[0], runs)
    fitted = Refinement(runs, baseline, np.ones(4))([Candidate(ripple, ((least + 0.5,),))])
    assert fitted.causes[0].shapes[0][0] * np.ptp(angle) / (2.0 * np.pi) >= 1.5
