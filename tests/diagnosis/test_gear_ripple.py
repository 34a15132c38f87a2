"""A gear with several ripple lines, and friction that builds up over a travel: all are found."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import table

RATE_HZ, PERIOD_S, PERIODS = 64.0, 22.0, 8
LINES = ((2.0, 88.3, 3.0), (1.0, 34.9, 1.0), (0.3, 70.7, -3.0), (0.15, 176.7, -1.4))
"""N·m, cycles a turn and phase of each."""


def level_joint(seed, lines=LINES, friction=5.4, travel=0.02):
    """Return a training and a validation run of a joint that carries no weight."""
    time = np.arange(0.0, PERIODS * PERIOD_S, 1.0 / RATE_HZ)
    w = 2.0 * np.pi / PERIOD_S
    waves = ((1, 0.53, 0.79), (2, 0.05, 0.02), (3, 0.1, -0.02), (5, -0.01, 0.07))
    q = sum(a * np.sin(k * w * time) + b * np.cos(k * w * time) for k, a, b in waves)
    v = sum(k * w * (a * np.cos(k * w * time) - b * np.sin(k * w * time)) for k, a, b in waves)
    torque = (
        3.0 * np.gradient(v) * RATE_HZ + 0.6 * v + 0.7 + 0.6 * q + built_up(q, friction, travel)
    )
    torque += sum(size * np.sin(cycles * q + phase) for size, cycles, phase in lines)
    draw = np.random.default_rng(seed)
    angle, torque = q + draw.normal(0.0, 1e-4, len(q)), torque + draw.normal(0.0, 0.35, len(q))
    cut = int(0.7 * len(time))
    parts = {"train": slice(None, cut), "validate": slice(cut, None)}
    return [
        motion(time[s] - time[s][0], angle[s], torque[s], purpose) for purpose, s in parts.items()
    ]


def built_up(angle, friction, travel):
    """Return friction that turns over within a travel after each reversal (Dahl), N·m."""
    held = np.zeros(len(angle))
    for i, step in enumerate(np.diff(angle), 1):
        grown = held[i - 1] + step * friction / travel * (
            1.0 - np.sign(step) * held[i - 1] / friction
        )
        held[i] = np.clip(grown, -friction, friction)
    return held


def motion(time, angle, torque, purpose):
    recording = table(
        time, angle, torque, {"name": "joint", "kind": "revolute"}, purpose, gravity_m_s2=0.0
    )
    timing = {"sample_rate_hz": RATE_HZ, "period_s": PERIOD_S}
    recording = replace(recording, metadata=recording.metadata | timing)
    return replace(
        motion_from_table(motion_table(recording, FilterSettings())), file=f"{purpose}.parquet"
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_ripple_of_several_lines_and_friction_that_builds_up_are_both_named(seed):
    diagnosis = diagnose(level_joint(seed))
    assert {"cogging@joint", "presliding_hysteresis@joint"} <= set(diagnosis.causes)
    assert diagnosis.status == "explained"
    assert diagnosis.after.errors.rms[0] < 1.05 * diagnosis.floor_rms[0]
    (cogging,) = (cause for cause in diagnosis.after.fit.causes if cause.label == "cogging@joint")
    # Friction that builds up hides the second line from the baseline's residual.
    assert list(cogging.shapes[0]) == pytest.approx([88.3, 34.9, 70.7, 176.7], abs=0.4)


@pytest.mark.slow
def test_without_ripple_none_is_named():
    diagnosis = diagnose(level_joint(1, lines=()))
    assert "presliding_hysteresis@joint" in diagnosis.causes
    assert "cogging@joint" not in diagnosis.causes
