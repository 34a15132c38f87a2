import numpy as np
import pytest

from pipelines.mechanics.stretches import edge
from pipelines.signals import cutoff
from pipelines.signals.welch import Welch

RATE_HZ = 200.0
TIME = np.arange(0, 40, 1 / RATE_HZ)


def spectrum(x, rate_hz):
    welch = Welch(rate_hz, int(10.0 * rate_hz))
    welch.add(x[:, np.newaxis])
    return cutoff.spectrum(welch.frequency_hz, welch.density[:, 0], rate_hz)


def choose_cutoff(x, rate_hz, channels):
    return cutoff.choose_cutoff([x], len(x), rate_hz, channels)


def moving(harmonics=5, base_hz=0.2):
    return sum(np.sin(2 * np.pi * k * base_hz * TIME + k) / k**1.5 for k in range(1, harmonics + 1))


def test_the_floor_is_the_density_of_the_noise():
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(TIME))
    assert spectrum(moving() + noise, RATE_HZ).floor == pytest.approx(1e-8 / (RATE_HZ / 2), rel=0.1)


def test_more_noise_hides_more_of_the_signal():
    rng = np.random.default_rng(0)
    # Corners, as reversals of a sticking joint leave them: a spectrum without an end.
    rough = moving() + 0.02 * np.abs(np.sin(2 * np.pi * 0.5 * TIME)) ** 1.5
    meets = [
        spectrum(rough + s * rng.standard_normal(len(TIME)), RATE_HZ).meets_floor_hz
        for s in (1e-6, 1e-5, 1e-4)
    ]
    assert meets[0] > meets[1] > meets[2]


def test_at_200_hz_the_cutoff_lies_above_the_highest_harmonic_and_below_a_sixteenth_of_the_rate():
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(TIME))
    chosen = choose_cutoff((moving() + noise)[:, None], RATE_HZ, ("hip",))
    assert 2.0 <= chosen.hz <= RATE_HZ / 16
    assert chosen.reason.startswith("the hip angle's spectrum meets its noise floor")


@pytest.mark.parametrize(
    ("rate_hz", "highest"), [(50.0, 6.25), (100.0, 12.5), (200.0, 12.5), (500.0, 31.25)]
)
def test_the_highest_cutoff_is_12_5_hz_between_100_and_200_hz(rate_hz, highest):
    """At 100 Hz a cut-off of 6 Hz would smear the steps of friction beyond the samples that are
    left out."""
    time = np.arange(0.0, 60.0, 1.0 / rate_hz)
    corners = np.abs(np.sin(2 * np.pi * 0.5 * time)) ** 1.5
    assert choose_cutoff(corners[:, None], rate_hz, ("hip",)).hz == pytest.approx(highest)


def test_the_noisier_joint_decides():
    rng = np.random.default_rng(0)
    both = np.column_stack([moving(), moving()])
    rough = both + 0.02 * np.abs(np.sin(2 * np.pi * 0.5 * TIME))[:, None] ** 1.5
    coarse_hip = choose_cutoff(
        rough + rng.standard_normal(both.shape) * [1e-4, 1e-6], RATE_HZ, ("hip", "knee")
    )
    alone = choose_cutoff(
        rough[:, :1] + 1e-4 * rng.standard_normal((len(TIME), 1)), RATE_HZ, ("hip",)
    )
    assert "hip" in coarse_hip.reason
    assert coarse_hip.hz == pytest.approx(alone.hz, rel=0.3)


def test_a_fast_joint_keeps_its_motion_next_to_a_slow_one():
    noise = 1e-3 * np.random.default_rng(0).standard_normal((len(TIME), 2))
    chosen = choose_cutoff(
        np.column_stack([moving(5, 0.1), moving(5, 1.0)]) + noise, RATE_HZ, ("hip", "knee")
    )
    assert chosen.hz > 5.0
    assert "knee moves" in chosen.reason


@pytest.mark.parametrize("seconds", [10, 40])
def test_a_signal_at_rest_gets_a_cutoff_whose_edges_leave_a_part_of_it(seconds):
    samples = int(seconds * RATE_HZ)
    chosen = choose_cutoff(np.zeros((samples, 1)), RATE_HZ, ("hip",))
    assert 2 * edge(RATE_HZ, chosen.hz) < 0.8 * samples
