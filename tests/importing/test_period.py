"""A motion that repeats is known to, with its period; one that does not is taken for none."""

import re
import tomllib

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from exoid_cli.app import run
from pipelines.importing.time.period import better_period, repeats_after


def multisine(rng, time, period, joints=2):
    """Five harmonics at each joint, (n, joints) rad."""
    order = np.arange(1, 6)[:, np.newaxis]
    phase = 2 * np.pi * order * time / period
    return np.column_stack(
        [
            rng.normal(size=5) / order[:, 0] @ np.sin(phase + rng.uniform(0, 2 * np.pi, (5, 1)))
            for _ in range(joints)
        ]
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_period_is_found_through_ramps_drift_jitter_and_encoder_steps(seed):
    rng = np.random.default_rng(seed)
    period, periods, rate = (
        rng.choice([4.0, 7.3, 8.0, 10.0, 12.5, 20.0]),
        rng.uniform(3.2, 6.0),
        rng.choice([50, 333]),
    )
    time = np.cumsum(np.maximum(rng.normal(1.0, 0.1, int(periods * period * rate)), 0.2)) / rate
    angle = (
        multisine(rng, time, period) * np.minimum(time, 1.0)[:, np.newaxis]
        + 0.05 * time[:, np.newaxis] / time[-1]
    )
    period_s = repeats_after(time, np.round(angle / 0.002) * 0.002)
    assert period_s == pytest.approx(period, rel=5e-4)


def filtered_noise(rng, time):
    return sosfilt(
        butter(2, rng.uniform(0.05, 2.0), fs=100.0, output="sos"), rng.normal(size=len(time))
    )


def random_walk(rng, time):
    return np.cumsum(filtered_noise(rng, time))


def random_steps(rng, time):
    return np.repeat(rng.normal(size=len(time) // 100 + 1), 100)[: len(time)]


def chirp(rng, time):
    return np.sin(2 * np.pi * time * (0.2 + 0.3 * time / time[-1]))


def dying_swing(rng, time):
    return np.exp(-0.1 * time) * np.cos(4.0 * time)


@pytest.mark.parametrize("motion", [filtered_noise, random_walk, random_steps, chirp, dying_swing])
def test_a_motion_that_does_not_repeat_has_no_period(motion):
    for seed in range(40):
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, rng.uniform(10.0, 100.0), 0.01)
        assert repeats_after(time, motion(rng, time)[:, np.newaxis]) is None, seed


def test_a_joint_that_repeats_sooner_than_another_waits_for_it():
    time = np.arange(0.0, 40.0, 0.01)
    both = np.column_stack(
        [np.sin(2 * np.pi * time / 5.0), multisine(np.random.default_rng(1), time, 10.0, 1)[:, 0]]
    )
    assert repeats_after(time, both[:, :1]) == pytest.approx(5.0)
    assert repeats_after(time, both) == pytest.approx(10.0)


def test_rest_repeats_nothing_and_neither_does_less_than_two_periods():
    time = np.arange(0.0, 19.0, 0.01)
    assert repeats_after(time, np.zeros((len(time), 1))) is None
    assert repeats_after(time, multisine(np.random.default_rng(2), time, 10.0)) is None
    once = np.where(time < 3.0, np.sin(2 * np.pi * time / 3.0), 0.0)
    assert repeats_after(time, once[:, np.newaxis]) is None


@pytest.mark.parametrize("seed", range(6))
def test_a_period_by_a_factor_too_long_is_told_from_the_right_one_and_its_multiples(seed):
    rng = np.random.default_rng(seed)
    period = rng.choice([4.0, 7.3, 10.0])
    time = np.arange(0.0, rng.uniform(4.0, 6.0) * period, 0.02)
    angle = multisine(rng, time, period) * np.minimum(time, 1.0)[:, np.newaxis]
    angle += 0.01 * angle.std(axis=0) * rng.normal(size=angle.shape)
    for factor in (0.77, 1.02, 1.3, 1.5):
        assert better_period(time, angle, factor * period) == pytest.approx(period, rel=2e-3)
    for factor in (1.0, 1.001, 2.0):
        assert better_period(time, angle, factor * period) is None


@pytest.mark.parametrize("motion", [filtered_noise, random_walk, random_steps, chirp, dying_swing])
def test_a_motion_without_a_period_has_no_better_one_than_that_of_its_map(motion):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, rng.uniform(10.0, 100.0), 0.01)
        angle = motion(rng, time)[:, np.newaxis]
        assert better_period(time, angle, 0.3 * time[-1]) is None, seed


def repeated(rng):
    time = np.arange(0.0, 40.0, 0.005)
    angle = multisine(rng, time, 8.0, 1)[:, 0]
    return {
        "time": time,
        "angle_rad": angle,
        "torque_nm": np.sin(angle) + 0.1 * rng.normal(size=len(time)),
    }


def test_a_guess_has_the_period_of_each_file(tmp_path, write_csv, capsys):
    rng = np.random.default_rng(3)
    log = repeated(rng)
    wandering = log | {"angle_rad": random_walk(rng, log["time"])}
    logs = [write_csv(log, "one.csv"), write_csv(wandering, "two.csv")]
    assert run(["import", *map(str, logs), "--guess"]) == 0
    printed = capsys.readouterr().out.split("[[recording]]")
    assert "period_s = 8.0 " in printed[1]
    assert "# period_s: no motion repeats here" in printed[2]


@pytest.mark.parametrize(
    "wrap", [lambda counts: counts % 65536, lambda counts: (counts + 3900) % 4096]
)
@pytest.mark.parametrize("name", ["angle_counts", "ref_counts"])
def test_a_guess_looks_for_the_period_in_a_counter_that_is_counted_on(
    write_csv, capsys, wrap, name
):
    """With its sign lost, or full on the way, it steps where the motion does not, and by noise not
    in every period."""
    rng = np.random.default_rng(5)
    log = repeated(rng)
    noisy = log.pop("angle_rad") + 0.003 * rng.normal(size=len(log["time"]))
    log["angle_counts"] = log[name] = wrap(np.round(4096 / (2.0 * np.pi) * noisy).astype(int))
    path = write_csv(log)
    assert run(["import", str(path), "--guess"]) == 0
    period = re.search(r"^period_s = (\S+)", capsys.readouterr().out, re.MULTILINE)
    assert float(period[1]) == pytest.approx(8.0, rel=5e-4)


def test_a_set_point_is_counted_on_where_its_angle_is_and_not_where_it_steps_by_a_turn(
    write_csv, capsys
):
    log = repeated(np.random.default_rng(6))
    degrees = np.degrees(log.pop("angle_rad"))
    wraps = {"angle_deg": degrees % 360.0, "ref_deg": (degrees + 1.0) % 360.0}
    steps = {"angle_deg": degrees, "ref_deg": 360.0 * (log["time"] > 20.0)}
    for name, columns in (("wraps.csv", wraps), ("steps.csv", steps)):
        assert run(["import", str(write_csv(log | columns, name)), "--guess"]) == 0
        joint = tomllib.loads(capsys.readouterr().out)["joint"][0]
        assert [joint[quantity].get("wraps_at") for quantity in ("angle", "reference")] == (
            [360.0, 360.0] if name == "wraps.csv" else [None, None]
        )


def test_an_import_without_a_period_in_its_map_reports_that_the_motion_repeats(imported, write_csv):
    path = write_csv(repeated(np.random.default_rng(4)))
    text = """
        time = {column = "time", unit = "s"}
        [[joint]]
        name = "arm"
        angle = {column = "angle_rad", unit = "rad"}
        torque = {column = "torque_nm", unit = "N·m"}
        [[recording]]
        purpose = "train"
    """
    printed = imported(path, map_text=text).printed
    assert "the motion repeats every 8 s, but the map has no period_s" in printed
    assert "the motion repeats" not in imported(path, map_text=text + "period_s = 8.0").printed
    printed = imported(path, map_text=text + "period_s = 10.4").printed
    assert "the motion to train repeats every 8 s, but not after the 10.4 s" in printed
    assert "set period_s = 8" in printed
