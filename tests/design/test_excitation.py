"""Designs: what they reach, that they repeat, and what they say of themselves."""

import time

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import TRAJECTORY
from pipelines.design.excitation import design
from pipelines.design.quality import paper_model, quality, regressor, standard_errors
from pipelines.errors import InputError
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import margins
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings import datasets
from pipelines.settings.base import load_toml
from pipelines.settings.design import DesignSettings, JointBounds, NoiseSettings

PAPER = datasets() / "paper"
PAPERS_MEAN = (0.611, -0.925)

# Best condition numbers found by six optimisers: 38.19, 31.52 and 10.83; log det 10.77. These are
# to be reached.
GOALS = [
    pytest.param(
        {"harmonics": 2, "theta0_rad": PAPERS_MEAN, "criterion": "condition"},
        38.6,
        id="2-fixed-condition",
        marks=pytest.mark.slow,
    ),
    pytest.param({"harmonics": 2, "criterion": "condition"}, 32.0, id="2-free-condition"),
    pytest.param(
        {"harmonics": 5, "criterion": "condition"},
        11.9,
        id="5-free-condition",
        marks=pytest.mark.slow,
    ),
    pytest.param({"harmonics": 5, "criterion": "log_det"}, 10.5, id="5-free-log_det"),
]


def reached(found, goal):
    value = found.quality.value(found.settings.criterion)
    return value >= goal if found.settings.criterion == "log_det" else value <= goal


def quick(**changes):
    return DesignSettings(**{"particles": 16, "iterations": 50, "harmonics": 3, **changes})


@pytest.fixture(scope="module")
def published():
    return read_trajectory(PAPER / "trajectory.toml")


def test_the_published_excitation_has_the_published_model_s_condition_numbers(published):
    found = quality(published, DesignSettings(), Geometry())
    # 47.3 for 8 columns, 22.6 for the inertial ones, 5.8 scaled; recomputed from the
    # printed coefficients.
    assert f"{found.condition:.1f}" == "47.3"
    assert f"{found.inertial_condition:.1f}" == "22.6"
    assert f"{found.scaled_condition:.1f}" == "5.8"
    assert f"{found.log_det:.2f}" == "-3.72"


def test_the_default_bounds_are_the_paper_s_table_2():
    assert load_toml(PAPER / "table2.toml", JointBounds) == JointBounds()


@pytest.mark.parametrize(("settings", "goal"), GOALS)
def test_a_design_reaches_the_best_known_within_a_few_percent(settings, goal):
    found = design(DesignSettings(seed=3, **settings))
    assert reached(found, goal)
    assert all(margin.kept for margin in found.quality.margins)
    assert found.stopped_by != "seconds"


@pytest.mark.slow
@pytest.mark.parametrize(("settings", "goal"), GOALS)
def test_nine_seeds_of_ten_reach_the_goal_within_ten_seconds_of_one_core(settings, goal):
    design(DesignSettings(seed=0, **settings))  # compiled before the clock starts
    start = time.process_time()
    found = [design(DesignSettings(seed=seed, **settings)) for seed in range(10)]
    assert time.process_time() - start <= 10 * 10.0
    assert sum(reached(one, goal) for one in found) >= 9
    if settings == {"harmonics": 5, "criterion": "condition"}:
        assert min(one.quality.condition for one in found) <= 11.1


def test_a_scaled_condition_number_below_the_published_one_is_found(published):
    found = design(DesignSettings(criterion="scaled_condition", seed=1))
    assert (
        found.quality.scaled_condition
        < 0.7 * quality(published, DesignSettings(), Geometry()).scaled_condition
    )


def test_log_det_predicts_smaller_errors_of_inertia_than_the_published_excitation(published):
    settings = DesignSettings(seed=1)
    before = quality(published, settings, Geometry()).standard_errors
    after = design(settings).quality.standard_errors
    assert 4.0 < before["X1"] / after["X1"]  # five to seven times


@pytest.mark.parametrize("topology", ["ring", pytest.param("global", marks=pytest.mark.slow)])
def test_equal_seeds_give_equal_designs_and_other_seeds_others(topology):
    first, again, other = (
        design(quick(topology=topology, seed=seed)).trajectory for seed in (5, 5, 6)
    )
    assert_allclose(first.a, again.a, rtol=0, atol=0)
    assert_allclose(first.theta0, again.theta0, rtol=0, atol=0)
    assert not np.allclose(first.a, other.a)


def test_time_ends_a_search_and_the_design_still_keeps_its_bounds():
    found = design(DesignSettings(seconds=0.05, seed=1))
    assert found.stopped_by == "seconds"
    assert all(margin.kept for margin in found.quality.margins)


def test_the_mean_angles_stay_where_they_were_fixed():
    assert design(quick(theta0_rad=PAPERS_MEAN)).trajectory.theta0.tolist() == list(PAPERS_MEAN)


@pytest.mark.parametrize("harmonics", [2, 5])
def test_rest_to_rest_begins_and_ends_without_speed_or_acceleration(harmonics):
    found = design(quick(harmonics=harmonics, rest_to_rest=True))
    for t in (0.0, found.trajectory.period_s):
        _, dq, ddq = found.trajectory.at(t)
        assert_allclose(dq, 0.0, atol=1e-12)
        assert_allclose(ddq, 0.0, atol=1e-11)
    assert np.ptp(found.trajectory.extrema()[0], axis=-1).min() > 0.5  # and it moves in between


def test_the_search_reports_progress_from_nothing_to_all():
    seen = []
    design(quick(), report=lambda done, note: seen.append((done, note)))
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1][0] == 1.0
    assert seen[-1][1].startswith("log_det ")


def test_a_design_survives_its_file(tmp_path):
    found = design(quick())
    TRAJECTORY.write(tmp_path / "t.parquet", found.frame(), found.metadata())
    table = TRAJECTORY.read(tmp_path / "t.parquet")
    again = read_trajectory(tmp_path / "t.parquet")
    t = np.linspace(0.0, 20.0, 57)
    assert_allclose(again.at(t), found.trajectory.at(t))
    assert len(table.frame) == 2000
    assert table.metadata["criterion_value"] == found.quality.log_det
    assert set(table.metadata["standard_errors"]) == set(found.quality.standard_errors)
    assert [m["margin"] for m in table.metadata["margins"]] == [
        m.margin for m in margins(again, JointBounds())
    ]


@pytest.mark.parametrize("correlation_s", [0.0, 0.05])
def test_expected_standard_errors_are_the_scatter_of_simulated_fits(published, correlation_s):
    noise = NoiseSettings(hip_nm=1.5, knee_nm=0.5, correlation_s=correlation_s, duration_s=20.0)
    expected = standard_errors(published, noise, Geometry(), 100.0)
    time = np.arange(0.0, 20.0, 0.01)
    A = regressor(published, Geometry(), time)
    # 0.08 s around what is slower than 0.04 rad/s no fit looks at.
    slow = np.abs(published.at(time)[1]) < 0.04
    A[np.column_stack([np.convolve(column, np.ones(17), "same") > 0 for column in slow.T])] = 0.0
    size = np.array([noise.hip_nm, noise.knee_nm])
    fit = np.linalg.pinv((A / size[:, np.newaxis]).reshape(-1, 8))
    rng = np.random.default_rng(0)
    rho = np.exp(-0.01 / correlation_s) if correlation_s else 0.0
    trials, errors = 1500, []
    torque = rng.standard_normal((trials, 2))
    rows = []
    for _ in range(len(A)):
        rows.append(torque)
        torque = rho * torque + np.sqrt(1 - rho**2) * rng.standard_normal((trials, 2))
    errors = np.stack(rows, axis=1).reshape(trials, -1) @ fit.T
    # The scatter of 1500 fits is known to 2 %.
    assert_allclose(errors.std(axis=0), expected, rtol=0.08)
    covered = np.mean(np.abs(errors) < 1.96 * expected)
    assert 0.94 < covered < 0.96


def test_longer_correlation_of_the_noise_means_larger_errors(published):
    errors = [
        standard_errors(published, NoiseSettings(correlation_s=T), Geometry(), 200.0)
        for T in (0.0, 0.02, 0.1)
    ]
    assert np.all(errors[0] < errors[1]) and np.all(errors[1] < errors[2])


def test_a_leg_at_rest_identifies_nothing():
    still = FourierTrajectory(np.array([0.5, -1.0]), np.zeros((2, 1)), np.zeros((2, 1)), 1.0)
    found = quality(still, DesignSettings(), Geometry())
    assert found.condition > 1e12
    assert np.all(np.isinf(list(found.standard_errors.values())))
    assert found.as_metadata()["standard_errors"]["X1"] is None


def test_other_joints_than_hip_and_knee_are_refused(published, tmp_path):
    frame = pd.DataFrame({"time_s": [0.0, 1.0]})
    for quantity in ("position_m", "velocity_m_s", "acceleration_m_s2"):
        frame[f"x_{quantity}"] = 0.0
    TRAJECTORY.write(
        tmp_path / "t.parquet", frame, {"joints": [{"name": "x", "kind": "prismatic"}]}
    )
    with pytest.raises(
        InputError, match="the excitation moves the joints x, expected hip and knee"
    ):
        quality(read_trajectory(tmp_path / "t.parquet"), DesignSettings(), Geometry())


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {"theta0_rad": (0.6, 0.4)},
            "theta0_rad: found 0.4 at the knee, expected between its bounds -1.6232 and -0.2269; "
            'change one of them, or write "free"',
        ),
        (
            {"rest_to_rest": True, "harmonics": 1},
            "rest_to_rest: one harmonic is never at rest; set harmonics to 2 or more",
        ),
    ],
)
def test_impossible_settings_are_refused_in_one_line(changes, told):
    with pytest.raises(InputError) as error:
        DesignSettings().changed(**changes)
    assert str(error.value) == told


def test_the_model_of_the_design_has_the_paper_s_eight_parameters():
    names = [
        (effect.joint, parameter.symbol) for effect, parameter in paper_model().linear_parameters
    ]
    rigid = [(None, f"X{i}") for i in range(1, 5)]
    assert names == [*rigid, ("hip", "Ks"), ("hip", "Km"), ("knee", "Ks"), ("knee", "Km")]
