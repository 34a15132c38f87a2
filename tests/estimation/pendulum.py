"""A pendulum under its drive, which shares no code with exoid: sessions for the statistics of
estimators.

A sampled PD loop at 800 Hz acts on noisy angles, dry friction sticks, the torque sensor has
coloured noise and strays.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numba import njit
from scipy.signal import lfilter

from pipelines.contracts.table import Table
from pipelines.estimation.problem import Problem, Training
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.model import Model, baseline
from pipelines.settings.filter import FilterSettings

GRAVITY = 9.8
INERTIA, MOMENT, COULOMB, VISCOUS = 0.35, 1.1, 0.8, 0.6
TRUTH = np.array([INERTIA, MOMENT, COULOMB, VISCOUS])
KP, KD, RATE_HZ, TICKS, STEPS = 60.0, 8.0, 200.0, 4, 6
"""Ticks of the loop a sample; steps of the plant a tick."""


@njit(cache=True)
def _move(angle, speed, reference, noise, inertia, moment, coulomb, viscous, kp, kd, steps, h):
    """Semi-implicit Euler; a joint that friction can hold is held. Returns angle read and torque of
    each tick."""
    n = len(reference)
    read, torque = np.empty(n), np.empty(n)
    last = angle
    for k in range(n):
        read[k] = angle + noise[k]
        rate = (reference[k] - reference[max(k - 1, 0)]) / (steps * h)
        torque[k] = kp * (reference[k] - read[k]) + kd * (rate - (read[k] - last) / (steps * h))
        last = read[k]
        for _ in range(steps):
            push = torque[k] - moment * 9.8 * np.sin(angle) - viscous * speed
            free = speed + h * push / inertia
            most = h * coulomb / inertia
            speed = 0.0 if abs(free) <= most else free - most * np.sign(free)
            angle += h * speed
    return read, torque


@dataclass(frozen=True)
class Disturbed:
    """What spoils a session."""

    torque_nm: float = 0.3
    correlation_s: float = 0.02
    angle_rad: float = 0.0
    """White, of each reading, in the loop too."""
    outliers: float = 0.0
    """Share of samples whose torque is struck."""
    strike_nm: float = 15.0


def reference(time):
    """A rich motion, from no design program."""
    return 0.5 + sum(
        a * np.sin(w * time + p)
        for a, w, p in ((0.5, 1.26, 0.3), (0.3, 3.1, 1.1), (0.12, 7.5, 2.0), (0.05, 13.0, 0.7))
    )


def motion(disturbed, seed, seconds=20.0, purpose="train"):
    """Return one run as ``exoid filter`` would, at a fixed cut-off."""
    rng = np.random.default_rng(seed)
    ticks = round(seconds * RATE_HZ) * TICKS
    lead = 1000
    wanted = reference(np.arange(-lead, ticks) / (RATE_HZ * TICKS))
    noise = disturbed.angle_rad * rng.standard_normal(len(wanted))
    args = (INERTIA, MOMENT, COULOMB, VISCOUS, KP, KD, STEPS, 1.0 / (RATE_HZ * TICKS * STEPS))
    read, torque = (x[lead:] for x in _move(wanted[0], 0.0, wanted, noise, *args))
    angle = read[TICKS // 2 :: TICKS]
    mean = torque.reshape(-1, TICKS).mean(axis=1)
    rho = np.exp(-1.0 / (RATE_HZ * disturbed.correlation_s))
    coloured = lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal(len(mean) + 100))[100:]
    # A strike pushes the way the joint moves: what is symmetric would leave least squares unbiased.
    struck = (
        (rng.random(len(mean)) < disturbed.outliers)
        * disturbed.strike_nm
        * np.sign(np.gradient(angle))
    )
    frame = pd.DataFrame(
        {
            "time_s": np.arange(len(mean)) / RATE_HZ,
            "joint_angle_rad": angle,
            "joint_torque_nm": mean + disturbed.torque_nm * coloured + struck,
            "joint_reference_rad": wanted[lead + TICKS - 1 :: TICKS],
        }
    )
    controller = {
        "joint": {
            "type": "pd",
            "kp_nm_rad": KP,
            "kd_nm_s_rad": KD,
            "rate_hz": RATE_HZ * TICKS,
            "limit_nm": 200.0,
        }
    }
    metadata = {
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": RATE_HZ,
        "controller": controller,
        "joints": [{"name": "joint", "kind": "revolute"}],
        "geometry": {"gravity_m_s2": GRAVITY},
    }
    return motion_from_table(motion_table(Table(frame, metadata), FilterSettings(cutoff_hz=15.0)))


def problem(*runs):
    """Return the fit of rigid body and friction to some runs."""
    model = Model.of(baseline(runs[0].machine, ["exo_alone"]))
    columns = len(model.linear_parameters)
    return Problem(
        Training(tuple(runs), model), ("exo_alone",), np.arange(columns), np.zeros(columns)
    )
