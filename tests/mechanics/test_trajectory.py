"""Excitations: derivatives, extrema between samples, and what files of them may say."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.contracts import TRAJECTORY
from pipelines.errors import ContractError, SettingsError
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.limits import margins
from pipelines.mechanics.sampled_trajectory import SampledTrajectory
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings import datasets
from pipelines.settings.design import JointBounds

PAPER = datasets() / "paper" / "trajectory.toml"


@pytest.fixture
def random_trajectory():
    def make(seed, harmonics):
        a, b = np.random.default_rng(seed).normal(size=(2, 2, harmonics)) / harmonics
        return FourierTrajectory(np.array([0.6, -0.9]), a, b, omega=0.2 * np.pi)

    return make


def as_table(trajectory, rate_hz=100.0):
    time = np.arange(0.0, trajectory.period_s - 1e-9, 1.0 / rate_hz)
    q, dq, ddq = trajectory.at(time)
    columns = {"time_s": time}
    for j, joint in enumerate(("hip", "knee")):
        columns |= {f"{joint}_angle_rad": q[:, j], f"{joint}_velocity_rad_s": dq[:, j]}
        columns |= {f"{joint}_acceleration_rad_s2": ddq[:, j]}
    return pd.DataFrame(columns)


def coefficients(trajectory):
    return {
        "a": trajectory.a.tolist(),
        "b": trajectory.b.tolist(),
        "theta0_rad": trajectory.theta0.tolist(),
        "omega_rad_s": trajectory.omega,
    }


def test_velocity_and_acceleration_are_the_derivatives_of_the_angle(random_trajectory):
    t, h = np.linspace(0.0, 10.0, 50), 1e-5
    trajectory = random_trajectory(0, 5)
    q, dq, ddq = trajectory.at(t)
    ahead, behind = trajectory.at(t + h), trajectory.at(t - h)
    assert_allclose(dq, (ahead[0] - behind[0]) / (2 * h), atol=1e-8)
    assert_allclose(ddq, (ahead[1] - behind[1]) / (2 * h), atol=1e-8)
    assert q.shape == (50, 2)


@pytest.mark.parametrize("harmonics", [1, 2, 5, 12, 20])
def test_extrema_are_those_of_a_very_fine_grid(random_trajectory, harmonics):
    for seed in range(5):
        trajectory = random_trajectory(seed, harmonics)
        fine = trajectory.at(np.linspace(0.0, trajectory.period_s, 100_001))
        low, high = (np.array([pick(x, axis=0) for x in fine]) for pick in (np.min, np.max))
        reached = trajectory.extrema()
        size = np.abs(high - low)
        assert np.all(reached[..., 0] <= low + 1e-9 * size)
        assert np.all(reached[..., 1] >= high - 1e-9 * size)
        assert_allclose(reached, np.stack([low, high], axis=-1), atol=1e-5 * size.max())


def test_a_joint_that_stands_still_has_its_mean_angle_as_both_extrema():
    still = FourierTrajectory(np.array([0.5, -1.0]), np.zeros((2, 3)), np.zeros((2, 3)), 1.0)
    assert_allclose(still.extrema()[0], [[0.5, 0.5], [-1.0, -1.0]])
    assert_allclose(still.extrema()[1:], 0.0)


def test_the_published_excitation_keeps_table_2_and_touches_the_hip_s_lower_angle():
    by_name = {(m.joint, m.quantity): m for m in margins(read_trajectory(PAPER), JointBounds())}
    assert all(m.kept for m in by_name.values())
    # That it grazes the bounds to the printed digits is what shows the coefficients to be degrees.
    assert by_name["hip", "angle"].margin == pytest.approx(0.0, abs=5e-6)
    assert by_name["knee", "angle"].margin == pytest.approx(0.0, abs=1e-4)


def test_degrees_and_radians_describe_the_same_motion(tmp_path):
    paper = read_trajectory(PAPER)
    in_radians = tmp_path / "rad.toml"
    in_radians.write_text(
        f'unit = "rad"\nomega_rad_s = {paper.omega!r}\ntheta0_rad = {paper.theta0.tolist()}\n'
        f"a = {paper.a.tolist()}\nb = {paper.b.tolist()}\n"
    )
    assert_allclose(read_trajectory(in_radians).at(np.arange(20.0)), paper.at(np.arange(20.0)))


def test_coefficients_survive_a_table(tmp_path, random_trajectory):
    trajectory = random_trajectory(3, 4)
    TRAJECTORY.write(tmp_path / "t.parquet", as_table(trajectory), coefficients(trajectory))
    again = read_trajectory(tmp_path / "t.parquet")
    assert_allclose(again.at(np.linspace(0, 30, 77)), trajectory.at(np.linspace(0, 30, 77)))


def test_a_table_without_coefficients_is_followed_between_its_samples(tmp_path, random_trajectory):
    trajectory = random_trajectory(3, 4)
    path = tmp_path / "t.parquet"
    TRAJECTORY.write(path, as_table(trajectory), {"omega_rad_s": trajectory.omega})
    sampled = read_trajectory(path)
    assert isinstance(sampled, SampledTrajectory)
    t = np.linspace(0.0, 25.0, 333)
    for got, expected in zip(sampled.at(t), trajectory.at(t), strict=True):
        assert_allclose(got, expected, atol=1e-5)
    assert_allclose(sampled.extrema(), trajectory.extrema(), atol=1e-5)


def test_bare_samples_without_a_period_run_once(tmp_path, random_trajectory):
    path = tmp_path / "t.parquet"
    TRAJECTORY.write(path, as_table(random_trajectory(3, 4)), {})
    assert read_trajectory(path).period_s is None
    assert read_trajectory(path).duration_s == pytest.approx(9.99)


def test_a_table_whose_samples_and_coefficients_differ_is_refused(tmp_path, random_trajectory):
    trajectory = random_trajectory(3, 4)
    frame = as_table(trajectory)
    frame.loc[7, "knee_angle_rad"] = -0.5
    path = tmp_path / "t.parquet"
    TRAJECTORY.write(path, frame, coefficients(trajectory))
    expected = trajectory.at(0.07)[0][0, 1]
    with pytest.raises(ContractError) as error:
        read_trajectory(path)
    assert (
        str(error.value)
        == f"{path}: column knee_angle_rad, row 7: found -0.5, but the metadata's coefficients give"
        f" {expected:.6g}; drop a and b, or compute the rows from them"
    )


GOOD = {
    "unit": '"deg"',
    "omega_rad_s": "0.6",
    "theta0_rad": "[0.6, -0.9]",
    "a": "[[1], [2]]",
    "b": "[[1], [2]]",
}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"unit": None}, "unit: missing; add it"),
        ({"unit": '"grad"'}, "unit: found 'grad', expected 'deg' or 'rad'"),
        ({"omega_rad_s": "0.0"}, "omega_rad_s: found 0.0, expected greater than 0"),
        ({"a": '[["x"], [2]]'}, "a[0][0]: found 'x', expected a valid number"),
        ({"c": "1"}, "c: unknown key; known are unit, omega_rad_s, theta0_rad, a, b"),
        (
            {"a": "[[1, 2], [2]]"},
            (
                "found rows of different length or empty (a[0] 2, a[1] 1, b[0] 1, b[1] 1), "
                "expected as many harmonics in each"
            ),
        ),
        (
            {"unit": '"rad"', "b": "[[1], [-24.0]]"},
            'b[1][0]: found -24.0 with unit = "rad", which looks like degrees; write unit = "deg"',
        ),
    ],
)
def test_a_bad_coefficient_file_is_refused_in_one_line(tmp_path, change, told):
    path = tmp_path / "t.toml"
    path.write_text(
        "\n".join(f"{key} = {value}" for key, value in (GOOD | change).items() if value)
    )
    with pytest.raises(SettingsError) as error:
        read_trajectory(path)
    assert str(error.value) == f"{path}: {told}"


def test_a_missing_coefficient_file_is_named(tmp_path):
    with pytest.raises(SettingsError, match=r"nowhere\.toml: no such file; check the name"):
        read_trajectory(tmp_path / "nowhere.toml")
