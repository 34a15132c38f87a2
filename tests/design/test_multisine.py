"""Multisines: empty lines, bounds, crest factor, and what can be identified with them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import TRAJECTORY
from pipelines.design.excitation import design
from pipelines.design.lines import cut_periods, detection_lines, excited_lines
from pipelines.design.multisine import half_ranges
from pipelines.design.quality import crest_factor, quality
from pipelines.errors import InputError
from pipelines.investigation.polished_search import polished_search
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import bounds_array, margins
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.design import DesignSettings

SLOW = DesignSettings(criterion="multisine", harmonics=29, base_frequency_hz=0.05)


@pytest.fixture(scope="module")
def slow():
    return design(SLOW)


def spectrum(trajectory, harmonics):
    """Return the amplitude (harmonics + 1, J) of each line from samples of one period."""
    samples = 4 * harmonics
    q = trajectory.at(np.arange(samples) * trajectory.period_s / samples)[0]
    return 2.0 * np.abs(np.fft.rfft(q, axis=0))[: harmonics + 1] / samples


def on_bounds(lines, phases, settings):
    """Return a multisine of flat velocities and given phases (2, k), at the largest scale."""
    omega, bounds = 2.0 * np.pi * settings.base_frequency_hz, bounds_array(settings.bounds)
    theta0 = bounds[0].mean(axis=1)
    a, b = np.zeros((2, 2, settings.harmonics))
    a[:, lines - 1], b[:, lines - 1] = np.cos(phases) / lines, np.sin(phases) / lines
    reached = np.abs(FourierTrajectory(0.0 * theta0, a, b, omega).extrema()).max(axis=2)
    scale = (half_ranges(bounds, theta0) / reached).min(axis=0)[:, np.newaxis]
    return FourierTrajectory(theta0, scale * a, scale * b, omega)


@pytest.mark.parametrize("harmonics", [5, 6, 9, 12, 29, 30, 100])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_one_odd_line_of_each_two_to_four_is_empty_and_so_is_every_even_one(harmonics, seed):
    lines = excited_lines(harmonics, seed)
    assert np.all(lines % 2 == 1) and np.all(np.diff(lines) > 0)
    empty = np.setdiff1d(np.arange(1, harmonics + 1, 2), lines)
    assert -(-len(np.arange(1, harmonics + 1, 2)) // 4) == len(empty) >= 1
    # Each group has one, so neighbours are at most two groups of four apart.
    assert np.all(np.diff(empty) <= 2 * 7)


def test_the_empty_odd_lines_are_at_no_regular_distance():
    empty = [np.setdiff1d(np.arange(1, 60, 2), excited_lines(59, seed)) for seed in range(20)]
    assert len({tuple(one) for one in empty}) > 15
    assert sum(len(set(np.diff(one))) > 1 for one in empty) > 15


def test_empty_lines_are_empty_and_excited_ones_are_flat_in_velocity(slow):
    amplitude = spectrum(slow.trajectory, 60)
    excited = slow.trajectory.excited_lines
    empty = [k for k in range(1, 61) if k not in excited]
    assert excited == excited_lines(29, 1).tolist()
    assert np.abs(amplitude[empty]).max() < 1e-14
    velocity = amplitude[excited] * np.array(excited)[:, np.newaxis]
    assert_allclose(velocity, np.broadcast_to(velocity[0], velocity.shape), rtol=1e-9)


def test_the_second_half_of_a_period_is_the_first_one_mirrored(slow):
    # Only then is what an even nonlinearity makes apart from all that an odd one makes.
    time = np.linspace(0.0, 10.0, 77)
    q, dq, ddq = slow.trajectory.at(time)
    later = slow.trajectory.at(time + 10.0)
    theta0 = slow.trajectory.theta0
    assert_allclose(later[0] - theta0, theta0 - q, atol=1e-12)
    assert_allclose(later[1], -dq, atol=1e-12)
    assert_allclose(later[2], -ddq, atol=1e-11)


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"harmonics": 5, "base_frequency_hz": 0.1},
        {"harmonics": 100, "base_frequency_hz": 0.02},
        {"theta0_rad": (0.5, -1.2)},
    ],
    ids=["29", "5", "100", "given-means"],
)
def test_bounds_are_kept_at_every_time_and_one_of_each_joint_is_reached(settings):
    found = design(SLOW.changed(**settings))
    kept = margins(found.trajectory, SLOW.bounds)
    assert all(margin.kept for margin in kept)
    # A dense grid knows nothing of the roots by which extrema are found.
    time = np.arange(40000) * found.trajectory.period_s / 40000
    states = np.array(found.trajectory.at(time))
    bounds = bounds_array(SLOW.bounds)
    assert np.all(states.min(axis=1) > bounds[:, :, 0] - 1e-9)
    assert np.all(states.max(axis=1) < bounds[:, :, 1] + 1e-9)
    nearest = np.array([margin.margin for margin in kept]).reshape(2, 3).min(axis=1)
    assert_allclose(nearest, 0.0, atol=1e-9)
    if "theta0_rad" in settings:
        assert found.trajectory.theta0.tolist() == [0.5, -1.2]


@pytest.mark.parametrize(("harmonics", "factor"), [(29, 0.85), (59, 0.75)])
def test_the_crest_factor_is_well_below_that_of_random_phases(harmonics, factor):
    settings = SLOW.changed(harmonics=harmonics)
    found, lines, rng = design(settings), excited_lines(harmonics, 1), np.random.default_rng(0)
    random = [
        on_bounds(lines, rng.uniform(0.0, 2.0 * np.pi, (2, len(lines))), settings)
        for _ in range(31)
    ]
    crests = [crest_factor(one, settings.bounds) for one in random]
    assert found.quality.crest_factor < factor * np.median(crests)
    assert found.quality.crest_factor < min(crests)
    # The bounds are reached by all, so a lower crest factor is more speed at every line.
    rms = np.sqrt(np.mean([one.at(np.linspace(0, 20, 999))[1].std(axis=0) for one in random], 0))
    assert np.all(found.trajectory.at(np.linspace(0, 20, 999))[1].std(axis=0) > rms**2)


def test_a_sine_has_the_crest_factor_root_two():
    sine = FourierTrajectory(np.array([0.6, -0.9]), np.full((2, 1), 0.3), np.zeros((2, 1)), 2.0)
    assert crest_factor(sine, SLOW.bounds) == pytest.approx(np.sqrt(2.0), rel=1e-4)


@pytest.mark.parametrize("knee_rad", [0.0, -0.9])
def test_a_joint_at_rest_has_no_part_in_the_crest_factor(knee_rad):
    a = np.array([[0.3], [0.0]])
    sine = FourierTrajectory(np.array([0.6, knee_rad]), a, np.zeros((2, 1)), 2.0)
    assert crest_factor(sine, SLOW.bounds) == pytest.approx(np.sqrt(2.0), rel=1e-4)


def test_the_crest_factor_does_not_depend_on_the_scale_of_a_motion(slow):
    motion = slow.trajectory
    half = FourierTrajectory(motion.theta0, 0.5 * motion.a, 0.5 * motion.b, motion.omega)
    assert crest_factor(half, SLOW.bounds) == pytest.approx(slow.quality.crest_factor)


def test_equal_settings_give_equal_multisines_and_other_seeds_others(slow):
    again, other = design(SLOW), design(SLOW.changed(seed=2))
    assert_allclose(again.trajectory.a, slow.trajectory.a, rtol=0, atol=0)
    assert_allclose(again.trajectory.b, slow.trajectory.b, rtol=0, atol=0)
    assert other.trajectory.excited_lines != slow.trajectory.excited_lines


def test_a_multisine_identifies_better_than_most_random_motions_within_the_bounds(slow):
    rng, settings = np.random.default_rng(3), DesignSettings(harmonics=5, base_frequency_hz=0.1)
    lines = np.arange(1, 6)
    values = []
    for _ in range(40):
        motion = on_bounds(lines, rng.uniform(0.0, 2.0 * np.pi, (2, 5)), settings)
        values.append(quality(motion, settings, Geometry()))
    assert slow.quality.log_det > np.median([one.log_det for one in values])
    assert slow.quality.scaled_condition < np.median([one.scaled_condition for one in values])


def test_the_knee_s_delay_is_the_one_with_the_largest_log_det(slow):
    motion, k = slow.trajectory, np.arange(1, 30)
    others = []
    for turn in np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False):
        angle = (motion.b[1] - 1j * motion.a[1]) * np.exp(1j * k * turn)
        delayed = FourierTrajectory(
            motion.theta0,
            np.array([motion.a[0], -angle.imag]),
            np.array([motion.b[0], angle.real]),
            motion.omega,
        )
        others.append(quality(delayed, SLOW, Geometry()).log_det)
    assert slow.quality.log_det >= max(others) - 0.05
    assert slow.quality.log_det > min(others) + 0.5  # and it matters


def test_a_file_says_which_lines_are_empty_and_with_what_crest_factor(slow, tmp_path):
    TRAJECTORY.write(tmp_path / "t.parquet", slow.frame(), slow.metadata())
    table = TRAJECTORY.read(tmp_path / "t.parquet")
    excited = excited_lines(29, 1).tolist()
    assert sorted([*table.metadata["detection_lines"], *excited]) == list(range(1, 30))
    assert table.metadata["criterion"] == "multisine"
    assert table.metadata["criterion_value"] == slow.quality.crest_factor
    assert detection_lines(read_trajectory(table.path)) == table.metadata["detection_lines"]


def test_other_excitations_have_no_detection_lines():
    assert detection_lines(read_trajectory(datasets() / "paper" / "trajectory.toml")) == []
    quick = DesignSettings(harmonics=3, particles=16, iterations=25)
    assert "detection_lines" not in design(quick).metadata()


def test_a_search_with_another_cost_keeps_the_lines_and_the_bounds(slow):
    # It is what `exoid design --separate`, `--from` and `--sizes` do.
    settings = SLOW.changed(seconds=1.0)
    found = polished_search(
        settings,
        Geometry(),
        lambda motion, log_det: (-log_det, ""),
        lambda done, note: None,
        last=slow.trajectory,
    )
    assert set(found.trajectory.excited_lines) <= set(slow.trajectory.excited_lines)
    assert set(slow.detection_lines) <= set(found.detection_lines)
    assert all(margin.kept for margin in found.quality.margins)
    # The last motion is among the starts, and its repair costs next to nothing.
    assert found.quality.log_det > slow.quality.log_det - 0.1


def test_time_ends_a_multisine_too_and_its_bounds_are_kept():
    found = design(SLOW.changed(seconds=1e-3))
    assert found.stopped_by == "seconds"
    assert all(margin.kept for margin in found.quality.margins)


@pytest.mark.parametrize("duration_s", [40.0, 60.0, 100.0])
def test_whole_periods_are_not_warned_of(slow, duration_s):
    run = RunSettings(name="a", run="exo_alone", purpose="train", duration_s=duration_s)
    assert cut_periods([run], slow.trajectory) == []


@pytest.mark.parametrize(("duration_s", "better"), [(20.0, "40"), (50.0, "40"), (55.0, "60")])
def test_a_run_of_cut_periods_or_of_one_is_warned_of(slow, duration_s, better):
    run = RunSettings(name="a", run="exo_alone", purpose="train", duration_s=duration_s)
    assert cut_periods([run], slow.trajectory) == [
        f"run a lasts {duration_s:g} s, {duration_s / 20.0:.3g} periods; detection lines need two"
        f" or more whole ones, set duration_s = {better}"
    ]
    others = DesignSettings(harmonics=3, particles=16, iterations=25)
    assert cut_periods([run], design(others).trajectory) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"criterion": "multisine", "harmonics": 4},
            'harmonics: found 4, expected at least 5 with criterion = "multisine"; fewer leave no'
            " odd harmonic empty",
        ),
        (
            {"harmonics": 21},
            'harmonics: found 21, expected at most 20 with criterion = "log_det"; lower it, or set'
            ' criterion = "multisine"',
        ),
        (
            {"criterion": "multisine", "rest_to_rest": True},
            "rest_to_rest: a multisine of fixed amplitudes is never at rest; set it to false, or"
            " choose another criterion",
        ),
    ],
)
def test_settings_that_no_multisine_can_have_are_refused_in_one_line(changes, message):
    with pytest.raises(InputError) as error:
        DesignSettings().changed(**changes)
    assert str(error.value) == message
