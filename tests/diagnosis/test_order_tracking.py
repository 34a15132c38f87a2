"""Lines of the residual over angle are ripples, lines over time are hums, and noise has none."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.candidates.library import _ripples
from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.order_tracking import lines_of
from pipelines.diagnosis.evidence.whitened_residual import Trace
from pipelines.signals.blocks import BlockAverage
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import RICH, session

COLOURS = {
    "white": [1.0],
    "correlated": [1.0, -0.78],
    "red": [1.0, -0.98],
    "ringing": [1.0, -1.6, 0.9],
}
"""Recursions of noise at 200 Hz: correlated over 20 ms, over 250 ms, ringing at 18 Hz."""
FOUR = {34.9: 0.4, 88.3: 1.0, 200.0: 0.5, 351.0: 0.3}
"""N·m at cycles a turn."""


def noise(rng, count, colour="correlated", rms_nm=0.6):
    coloured = lfilter([1.0], COLOURS[colour], rng.standard_normal(count + 1000))[1000:]
    return rms_nm * coloured / coloured.std()


def traces(
    rng,
    joint=1,
    runs=4,
    seconds=70.0,
    colour="correlated",
    ripple=None,
    hum=None,
    motion=RICH,
):
    """Return a joint's residual in some runs: noise, a ripple of lines, a hum of any phases."""
    joints = []
    for _ in range(runs):
        time = np.arange(0.0, seconds, 0.005)
        q, dq, _ = motion.at(time)
        angle, speed = q[:, joint], dq[:, joint]
        residual = noise(rng, len(time), colour)
        for order, amplitude in (ripple or {}).items():
            residual += amplitude * np.sin(order * angle + 0.01 * order)
        for hz, amplitude in (hum or {}).items():
            residual += amplitude * np.sin(2.0 * np.pi * hz * time + rng.uniform(0.0, 6.28))
        usable = np.abs(speed) > 0.04
        joints.append(Trace(time, angle, speed, residual, usable, 200.0, motion.period_s))
    return joints


def lines_of_kinds(*joints):
    return [[(line.kind, line.cycles) for line in joint.lines] for joint in lines_of(joints)]


def test_four_lines_of_a_gear_are_found_though_block_averages_lose_most_of_the_fast_ones():
    fast = replace(RICH, omega=3.0 * RICH.omega)
    runs = traces(np.random.default_rng(1), ripple=FOUR, motion=fast)
    blocks = BlockAverage.lasting(0.025, 200.0)
    wave = np.sin(351.0 * runs[0].angle)
    passed = blocks.mean(wave, blocks.starts(np.zeros(len(wave), dtype=int)))
    assert np.mean(passed**2) < 0.35 * np.mean(wave**2)
    (joint,) = lines_of([runs])
    assert {line.kind for line in joint.lines} == {Kind.ANGLE}
    lines = sorted(joint.lines, key=lambda line: line.cycles)
    assert [line.cycles for line in lines] == pytest.approx(list(FOUR), abs=0.5)
    assert [line.amplitude for line in lines] == pytest.approx(list(FOUR.values()), rel=0.07)
    assert [line.phase for line in lines] == pytest.approx([0.349, 0.883, 2.0, -2.773], abs=0.35)
    over_time = joint.over_time.log_likelihood_ratio.max()
    assert all(line.log_likelihood_ratio > 10.0 * over_time for line in lines)


@pytest.mark.parametrize("hz", [7.31, 17.3, 50.0, 63.7])
def test_a_hum_is_no_ripple(hz):
    """50 Hz are a multiple of the motion's 0.1 Hz, as a mains hum is of any such."""
    (joint,) = lines_of([traces(np.random.default_rng(2), hum={hz: 0.25}, runs=2)])
    (line,) = joint.lines
    assert line.kind is Kind.TIME
    assert line.cycles == pytest.approx(hz, abs=0.005)
    assert line.amplitude == pytest.approx(0.25, rel=0.1)
    assert line.log_likelihood_ratio > 10.0 * joint.over_angle.log_likelihood_ratio.max()


def test_a_ripple_is_no_hum_and_both_together_are_both():
    rng = np.random.default_rng(3)
    ripple, hum = {120.4: 0.4}, {23.0: 0.2}
    alone, both = lines_of_kinds(traces(rng, ripple=ripple), traces(rng, ripple=ripple, hum=hum))
    assert [kind for kind, _ in alone] == [Kind.ANGLE]
    assert sorted(kind for kind, _ in both) == [Kind.ANGLE, Kind.TIME]
    assert dict(both)[Kind.ANGLE] == pytest.approx(120.4, abs=0.5)
    assert dict(both)[Kind.TIME] == pytest.approx(23.0, abs=0.005)


@pytest.mark.slow
def test_noise_of_any_colour_shows_a_line_in_fewer_than_one_session_in_a_hundred():
    rng = np.random.default_rng(4)
    sessions, alarms = 240, Counter()
    for number in range(sessions):
        colour = list(COLOURS)[number % len(COLOURS)]
        seconds, runs = (20.0, 40.0)[number % 2], (1, 2, 4)[number % 3]
        joints = [traces(rng, joint, runs, seconds, colour) for joint in (0, 1)]
        alarms[colour] += any(lines_of_kinds(*joints))
    assert alarms.total() <= 0.01 * sessions, alarms


@pytest.mark.parametrize(
    "law",
    [
        lambda q, v: 8.0 * (q + 0.9) ** 2 - 5.0 * q**3,
        lambda q, v: 60.0 * np.maximum(0.0, q + 0.8) ** 1.5,
        lambda q, v: 3.0 * np.sign(v) * np.exp(-((v / 0.15) ** 2)) + 2.0 * v * np.abs(v),
        lambda q, v: 2.0 * np.sin(11.0 * q),
    ],
    ids=["bent spring", "end stop", "friction", "a wave and a half"],
)
def test_a_smooth_law_of_angle_or_speed_is_no_line(law):
    joint = [
        Trace(t.time, t.angle, t.speed, t.residual + law(t.angle, t.speed), t.usable, 200.0, 10.0)
        for t in traces(np.random.default_rng(5), runs=2)
    ]
    assert lines_of_kinds(joint) == [[]]


def test_a_line_above_half_the_sampling_rate_is_seen_where_the_joint_is_slow():
    """350 cycles a turn at 2.4 rad/s are 134 Hz, sampled at 200."""
    rng = np.random.default_rng(6)
    time = np.arange(0.0, 40.0, 0.005)
    angle, speed = 1.5 * np.sin(1.6 * time), 2.4 * np.cos(1.6 * time)
    residual = noise(rng, len(time)) + 0.5 * np.sin(350.0 * angle)
    trace = Trace(time, angle, speed, residual, np.abs(speed) > 0.04, 200.0)
    ((line,),) = lines_of_kinds([trace])
    assert line[1] == pytest.approx(350.0, abs=0.2)


def test_a_joint_that_stands_still_has_no_lines():
    still = traces(np.random.default_rng(7), runs=1)[0]
    nowhere = np.zeros_like(still.angle)
    unusable = np.zeros(len(nowhere), dtype=bool)
    trace = Trace(still.time, nowhere, nowhere, still.residual, unusable, 200.0)
    assert lines_of_kinds([trace]) == [[]]


def test_gaps_and_samples_that_cannot_be_used_are_left_out():
    (trace,) = traces(np.random.default_rng(8), runs=1, ripple={88.3: 0.8})
    kept = np.delete(np.arange(len(trace.time)), np.s_[3000:3400])
    residual = trace.residual.copy()
    residual[5000:5200], usable = np.nan, trace.usable.copy()
    usable[5000:5200] = False
    parts = (x[kept] for x in (trace.time, trace.angle, trace.speed, residual, usable))
    ((line,),) = lines_of_kinds([Trace(*parts, 200.0)])
    assert line == (Kind.ANGLE, pytest.approx(88.3, abs=0.5))


def test_lines_that_a_leg_hides_behind_its_position_loops_become_one_candidate_of_both():
    hidden = {
        "amplitude": 1.2,
        "cycles_per_turn": 88.3,
        "phase": 0.4,
        "amplitude_2": 0.9,
        "cycles_per_turn_2": 199.0,
        "phase_2": -1.0,
    }
    look = Screening.of(session("cogging", "knee", **hidden))
    (ripple,) = _ripples(look.prepared, look.alone, look.regression)
    assert ripple.candidate.label == "cogging@knee"
    assert sorted(ripple.candidate.shapes[0]) == pytest.approx([88.3, 199.0], abs=0.5)
    assert ripple.columns.shape[1] == 4, "a sine and a cosine of each line"
