"""What a residual depends on is found, and noise depends on nothing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.dependence.explained_share import dependences, describe, excesses
from pipelines.diagnosis.dependence.smooth_term import smooth_term
from pipelines.diagnosis.detectability.planned_runs import planned_motions
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.machine import THE_LEG
from pipelines.settings.design import NoiseSettings
from pipelines.settings.rig.plant import PlantSettings

NOISE = NoiseSettings(duration_s=60.0)
FLOOR = Floor(np.array([0.4, 0.4, np.nan, np.nan]), np.full(4, 0.2), from_periods=True)
KINDS = ("exo_alone", "with_human")


def moved(seed):
    """Runs on an excitation of its own, within what a leg can do."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 2, 4)) * [0.3, 0.2, 0.12, 0.08]
    trajectory = FourierTrajectory(theta0=np.array([0.6, -0.9]), a=a, b=b, omega=0.2 * np.pi)
    return [observe(m) for m in planned_motions(trajectory, PlantSettings(), NOISE, KINDS, 200.0)]


@pytest.fixture(scope="module")
def runs():
    return moved(1)


@pytest.fixture(scope="module")
def fresh():
    return moved(2)


def noise(runs, rng, rms=0.4):
    """Coloured noise of every output; a block resembles the one before it."""
    return [
        rms * lfilter([0.6], [1, -0.8], rng.normal(size=run.measured.shape), axis=0) for run in runs
    ]


LAWS = {
    "angle": lambda run: 4.0 * np.maximum(-0.9 - run.state[0][:, 1], 0.0) ** 1.5 * 3.0,
    "speed": lambda run: 8.0 * np.abs(run.state[1][:, 1]),
    "other_angle": lambda run: 1.5 * np.sin(5.0 * run.state[0][:, 0]),
    "time": lambda run: 6.0 * np.exp(-run.time / 30.0),
}


def product(run):
    """Torque lost where both joints move: neither speed alone foretells it."""
    return 12.0 * run.state[1][:, 0] * run.state[1][:, 1]


def with_law(runs, rng, law, kinds=KINDS):
    """Noise, and a law at the knee."""
    residuals = noise(runs, rng)
    for run, residual in zip(runs, residuals, strict=True):
        if run.motion.run in kinds:
            residual[:, 1] += law(run)
    return residuals


def rms(runs, residuals, j=1):
    known = [e[run.usable[:, j], j] for run, e in zip(runs, residuals, strict=True)]
    return np.sqrt(np.mean(np.concatenate(known) ** 2))


@pytest.mark.parametrize("variable", LAWS)
def test_the_variable_behind_a_residual_comes_first(runs, variable):
    ranked = dependences(runs, with_law(runs, np.random.default_rng(0), LAWS[variable]))
    first = next(d for d in ranked if d.joint == "knee")
    assert first.variable == variable
    law = np.concatenate([LAWS[variable](run)[run.usable[:, 1]] for run in runs])
    assert 0.5 < first.share < law.var() / (law.var() + 0.4**2) + 0.02
    assert max(d.share for d in ranked if d.joint == "hip") < 0.05


def test_coloured_noise_depends_on_nothing(runs):
    for seed in range(5):
        ranked = dependences(runs, noise(runs, np.random.default_rng(seed)))
        assert max(d.share for d in ranked) < 0.05


def test_a_tone_between_the_harmonics_is_found_with_its_frequency(runs):
    residuals = noise(runs, np.random.default_rng(1))
    for phase, (run, residual) in enumerate(zip(runs, residuals, strict=True)):
        residual[:, 0] += np.sin(2 * np.pi * 3.137 * run.time + phase)
    first = dependences(runs, residuals)[0]
    assert (first.joint, first.variable) == ("hip", "tone")
    assert "3.14 Hz" in first.sentence


def test_a_tone_in_step_with_the_motion_and_faster_than_it_is_reported_as_such(runs):
    residuals = noise(runs, np.random.default_rng(1))
    for residual, run in zip(residuals, runs, strict=True):
        residual[:, 0] += np.sin(2 * np.pi * 3.3 * run.time)
    ranked = dependences(runs, residuals)
    assert (ranked[0].joint, ranked[0].variable) == ("hip", "tone")
    assert "3.30 Hz above the motion's own band, in step with its period" in ranked[0].sentence
    assert "depends on nothing" not in describe(THE_LEG, ranked, excesses(runs, residuals, FLOOR))


def test_a_law_of_the_motion_is_reported_as_no_tone_in_step_with_it(runs):
    for law in LAWS.values():
        ranked = dependences(runs, with_law(runs, np.random.default_rng(0), law))
        assert not any("in step with" in d.sentence for d in ranked)


def test_the_description_names_joint_variable_and_kind_of_run(runs):
    residuals = with_law(runs, np.random.default_rng(2), LAWS["angle"], kinds=("with_human",))
    text = describe(THE_LEG, dependences(runs, residuals), excesses(runs, residuals, FLOOR))
    assert "remaining error at the knee depends on the knee's angle" in text
    assert "mostly with the human" in text


def test_of_noise_it_is_said_that_nothing_foretells_it(runs):
    residuals = noise(runs, np.random.default_rng(3))
    text = describe(THE_LEG, dependences(runs, residuals), excesses(runs, residuals, FLOOR))
    assert "depends on nothing that was measured" in text
    # Others are not looked for, so nothing is said of them.
    assert "no variable and no steady tone predicts" in text


def test_a_law_learnt_on_one_excitation_lowers_the_error_on_another(runs, fresh):
    rng = np.random.default_rng(4)
    for law in (LAWS["speed"], LAWS["angle"], product):
        term = smooth_term(runs, with_law(runs, rng, law))
        before = with_law(fresh, rng, law)
        after = [e - term.torque(run) for run, e in zip(fresh, before, strict=True)]
        # The other excitation reaches beyond what was learnt, where a curve stays at its last
        # value.
        assert rms(fresh, after) < 0.9 * rms(fresh, before)


def test_two_variables_are_named_where_neither_alone_foretells(runs):
    residuals = with_law(runs, np.random.default_rng(5), product)
    surfaces = smooth_term(runs, residuals).surfaces
    text = describe(
        THE_LEG, dependences(runs, residuals), excesses(runs, residuals, FLOOR), surfaces
    )
    assert "together with" in text


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 5))]
)
def test_noise_leaves_no_smooth_term(runs, seed):
    assert smooth_term(runs, noise(runs, np.random.default_rng(seed))).surfaces == ()


def test_a_wander_of_each_runs_own_is_no_law(runs):
    rng = np.random.default_rng(6)
    residuals = noise(runs, rng)
    for run, residual in zip(runs, residuals, strict=True):
        wander = lfilter([1.0], [1, -0.98], rng.normal(size=len(run.time)))
        residual[:, 1] += wander / wander.std()
    assert smooth_term(runs, residuals).surfaces == ()


def test_a_run_that_does_not_know_a_variable_is_left_unexplained(runs):
    cold = [replace(run, motion=replace(run.motion, temperature=None)) for run in runs]
    names = {d.variable for d in dependences(cold, noise(cold, np.random.default_rng(7)))}
    assert "temperature" not in names
    assert "cuff_force" not in names
