"""What a motion and a noise would reveal: the formula against simulated noise, and ties known
beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detectability import (
    DetectionResult,
    _alike,
    detectability,
    needed_noncentrality,
)
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.planned_runs import planned_motions, planned_noise
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings.datasets import datasets
from pipelines.settings.design import NoiseSettings
from pipelines.settings.rig.plant import PlantSettings
from pipelines.signals.blocks import BlockAverage

NOISE = NoiseSettings(duration_s=40.0)
RICH = FourierTrajectory(
    theta0=np.array([0.6, -0.9]),
    a=np.array([[0.20, -0.10, 0.05, 0.03], [-0.15, 0.12, 0.06, -0.04]]),
    b=np.array([[0.08, 0.06, -0.07, 0.02], [0.10, -0.08, 0.05, 0.05]]),
    omega=0.2 * np.pi,
)


def runs_on(trajectory, kinds=("exo_alone", "with_human")):
    return [observe(m) for m in planned_motions(trajectory, PlantSettings(), NOISE, kinds, 200.0)]


def looked_at(trajectory, floor=None, kinds=("exo_alone", "with_human")):
    runs = runs_on(trajectory, kinds)
    floor = floor or planned_noise(NOISE, 200.0, runs[0].block)
    return {one.effect.label: one for one in detectability(runs, baseline_of(runs), floor)}


@pytest.fixture(scope="module")
def rich():
    return looked_at(RICH)


SLOW = 0.8
"""Correlation of neighbouring blocks: one in nine is independent."""


def coloured(rng, rms, shape):
    """Noise whose every block resembles the one before it."""
    return lfilter([np.sqrt(1 - SLOW**2)], [1, -SLOW], rng.normal(size=shape), axis=0) * rms


def rows_of(parts, runs, root):
    """Usable rows of the drives, (rows, ...), each output in units of its noise."""
    scaled = [np.moveaxis(np.moveaxis(part, 1, -1) * root, -1, 1) for part in parts]
    return np.concatenate([p[run.usable[:, :2]] for p, run in zip(scaled, runs, strict=True)])


@pytest.mark.parametrize(
    "label", ["coulomb_asymmetry@knee", "rotor_inertia@knee", "quadratic_drag@hip"]
)
def test_an_effect_of_the_smallest_size_is_found_as_often_as_promised(label):
    rms = np.array([2.0, 1.5])  # large enough that noise, not background, sets the size
    share = (1 - SLOW) / (1 + SLOW)
    runs = runs_on(RICH, ("exo_alone",))
    baseline = baseline_of(runs)
    floor = Floor(np.append(rms, [np.nan, np.nan]), np.full(4, share), from_periods=False)
    one = next(d for d in detectability(runs, baseline, floor) if d.effect.label == label)
    assert one.limited_by == "noise"
    candidate = Candidate(one.effect, ((),))
    own = [torque_columns(candidate, r, run)[:, :2] for r, run in enumerate(runs)]
    plain = [columns_under((), run, baseline)[0][:, :2] for run in runs]
    root = np.sqrt(min(CRITERIA.drive_weight, 1.0) * share) / rms
    independent = share * max(sum(run.usable[:, o].sum() for run in runs) for o in (0, 1))
    price = 0.5 * np.log(independent) - CRITERIA.cause - CRITERIA.base_rate
    effect = one.smallest * rows_of(own, runs, root)[:, 0]
    basis = np.linalg.qr(rows_of(plain, runs, root))[0]
    remainder = effect - basis @ (basis.T @ effect)
    remainder /= np.linalg.norm(remainder)
    rng = np.random.default_rng(3)
    detected = {1.0: 0, 0.3: 0}
    trials = 400
    for _ in range(trials):
        noise = rows_of([coloured(rng, rms, run.measured[:, :2].shape) for run in runs], runs, root)
        for factor in detected:
            # What the fit's squared error drops by.
            gain = 0.5 * (remainder @ (factor * effect + noise)) ** 2
            detected[factor] += gain > price
    # Slow effects meet the noise at its strongest, where the integrated correlation is exact; fast
    # ones fare better, and a likelihood that counts less than its rows do promises less than it
    # holds.
    assert 0.83 < detected[1.0] / trials
    assert detected[0.3] / trials < 0.1


def test_the_needed_noncentrality_is_the_square_of_two_quantiles():
    # z_a = sqrt(2 x 6.5) and z_b = 1.2816 for one column and a power of 90 %.
    assert needed_noncentrality(1, 6.5, 0.9) == pytest.approx(
        (np.sqrt(13.0) + 1.2816) ** 2, rel=1e-3
    )


def test_where_anything_would_show_an_effect_must_be_some_times_what_a_good_rig_has():
    runs = 3 * runs_on(RICH)
    smallest = []
    for rms in (0.01, 0.005):
        floor = Floor(np.array([rms, rms, np.nan, np.nan]), np.ones(4), from_periods=False)
        smallest += [
            d
            for d in detectability(runs, baseline_of(runs), floor)
            if d.effect.label == "quadratic_drag@knee"
        ]
    assert [one.limited_by for one in smallest] == ["background"] * 2
    loud, quiet = (one.smallest_rms_nm / one.torque_rms_nm for one in smallest)
    assert 2.0 * CRITERIA.background_cause < loud < 8.0 * CRITERIA.background_cause
    assert quiet == pytest.approx(loud, rel=0.01), "half the noise shows none that is smaller"


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("torque_offset@hip", "coulomb_asymmetry@hip"),
        ("torque_offset@knee", "coulomb_asymmetry@knee"),
        ("base_tilt", "encoder_offset@hip"),
    ],
)
def test_structural_ties_are_never_apart(rich, one, other):
    assert other in rich[one].never_apart
    assert one in rich[other].never_apart


def test_one_kind_of_run_ties_a_mass_off_the_axis_to_encoder_and_spring_and_two_part_them(
    rich,
):
    alone = looked_at(RICH, kinds=("exo_alone",))["mass_off_axis@knee"].tied_with
    parted = {"encoder_eccentricity@knee", "joint_elasticity@hip"}
    assert parted <= set(alone)
    assert set(rich["mass_off_axis@knee"].tied_with) < set(alone) - parted


def test_causes_that_look_different_are_not_tied(rich):
    assert "viscous_asymmetry@knee" not in rich["parallel_spring@knee"].tied_with
    assert "torque_drift@hip" not in rich["torque_drift@knee"].tied_with


def test_a_single_sine_hides_a_spring_that_a_rich_motion_shows(rich):
    published = looked_at(read_trajectory(datasets() / "paper" / "trajectory.toml"))[
        "parallel_spring@hip"
    ]
    assert published.smallest_rms_nm > published.torque_rms_nm
    spring = rich["parallel_spring@hip"]
    assert spring.smallest_rms_nm < 0.1 * spring.torque_rms_nm


def test_twice_the_noise_hides_effects_twice_as_large():
    floor = planned_noise(NOISE, 200.0, BlockAverage(5))
    loud, louder = (
        looked_at(RICH, replace(floor, rms=times * floor.rms)) for times in (40.0, 80.0)
    )
    for label in ("viscous_asymmetry@knee", "cogging@hip", "encoder_offset@hip"):
        assert loud[label].limited_by == louder[label].limited_by == "noise"
        assert louder[label].smallest_rms_nm == pytest.approx(
            2 * loud[label].smallest_rms_nm, rel=0.1
        )


def test_planned_noise_is_what_block_averages_of_coloured_noise_have():
    rng = np.random.default_rng(1)
    rho = np.exp(-1.0 / (200.0 * NOISE.correlation_s))
    noise = NOISE.hip_nm * lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.normal(size=200_000))
    blocks = noise.reshape(-1, 5).mean(axis=1)
    long = noise.reshape(-1, 1000).mean(axis=1)
    floor = planned_noise(NOISE, 200.0, BlockAverage(5))
    assert floor.rms[0] == pytest.approx(blocks.std(), rel=0.03)
    assert floor.independent_share[0] == pytest.approx(blocks.var() / (200 * long.var()), rel=0.25)


def test_what_a_motion_shows_at_no_size_is_like_nothing_that_it_shows():
    unseen = DetectionResult(
        (),
        np.inf,
        np.inf,
        "noise",
        np.inf,
        *[np.zeros((0, 0))] * 3,
        plausible=False,
        candidate=None,
    )
    assert not _alike(unseen, np.array([0.0, 0.5, 1.0])).any()


def test_what_the_background_leaves_is_the_product_with_the_inverse_of_its_covariance():
    rng = np.random.default_rng(4)
    problem = DetectionProblem.of(
        [at_block_rate(run) for run in runs_on(RICH, ("exo_alone",))],
        baseline_of(runs_on(RICH, ("exo_alone",))),
        planned_noise(NOISE, 200.0, BlockAverage(5)),
    )
    columns, remainder = rng.normal(size=(60, 5)), rng.normal(size=60)
    for scale in (0.0, 0.3, 100.0):
        B = scale * columns
        shown = replace(problem, background=B).shown(remainder)
        whole = remainder @ np.linalg.solve(np.eye(60) + B @ B.T, remainder)
        assert shown == pytest.approx(whole, rel=1e-4)
    # A column of the background itself leaves what its standard deviation is of it.
    assert replace(problem, background=1e6 * columns).shown(1e6 * columns[:, 0]) < 1.01
