"""A double pendulum with one drive, by Lagrange's equations and Runge and Kutta's method."""

from math import cos, sin, tanh
from pathlib import Path

import numpy as np
import pandas as pd

from pipelines.contracts.table import Table
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings

LENGTH, MASSES, CENTRES, INERTIAS, GRAVITY = 0.3, (0.5, 0.4), (0.15, 0.2), (0.02, 0.01), 9.81
X3 = MASSES[1] * CENTRES[1]
X2 = MASSES[1] * CENTRES[1] ** 2 + INERTIAS[1]
X1 = INERTIAS[0] + MASSES[1] * LENGTH**2 + X2
X4 = MASSES[0] * CENTRES[0] + MASSES[1] * LENGTH
COULOMB, VISCOUS = (0.05, 0.02), (0.05, 0.01)
TRUTH = [X1, X2, X3, X4, COULOMB[0], VISCOUS[0], COULOMB[1], VISCOUS[1]]


def free_elbow(seed, seconds=16.0, speed=0.0, spring=0.0, noise=0.02, driven=0, rate_hz=200.0):
    """Return a log of time, angles and torques; ``noise`` is a share of the torque's rms.

    The elbow begins with a speed, rad/s, and may have a spring of so many N·m/rad. ``driven`` is
    the joint with a drive: 0 for the shoulder.
    """
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    size = (1.0, 0.35)[driven]

    def drive(t):
        waves = zip((0.5, 0.3, 0.2), (1.7, 0.9, 2.3), phases, strict=True)
        return size * sum(a * sin(2.0 * np.pi * t / p + phase) for a, p, phase in waves)

    def rates(t, state):
        q1, q2, v1, v2 = state
        coupling = LENGTH * X3
        m11, m12, m22 = X1 + 2.0 * coupling * cos(q2), X2 + coupling * cos(q2), X2
        swing, weight = coupling * sin(q2), X3 * GRAVITY * sin(q1 + q2)
        torque = [0.0, 0.0]
        torque[driven] = drive(t)
        rest = [
            torque[j] - COULOMB[j] * tanh(v / 0.01) - VISCOUS[j] * v for j, v in enumerate((v1, v2))
        ]
        rest[0] += swing * (2.0 * v1 * v2 + v2**2) - X4 * GRAVITY * sin(q1) - weight
        rest[1] -= swing * v1**2 + weight + spring * q2
        determinant = m11 * m22 - m12**2
        a1 = (m22 * rest[0] - m12 * rest[1]) / determinant
        a2 = (m11 * rest[1] - m12 * rest[0]) / determinant
        return np.array([v1, v2, a1, a2])

    steps, h = 5, 1.0 / rate_hz / 5
    state, rows = np.array([0.0, 0.0, 0.0, speed]), []
    for k in range(round(seconds * rate_hz)):
        rows.append(state[:2])
        for i in range(steps):
            t = k / rate_hz + i * h
            one = rates(t, state)
            two = rates(t + h / 2, state + h / 2 * one)
            three = rates(t + h / 2, state + h / 2 * two)
            state = state + h / 6 * (one + 2 * two + 2 * three + rates(t + h, state + h * three))
    time = np.arange(len(rows)) / rate_hz
    torque = np.array([drive(t) for t in time])
    draw = np.random.default_rng(1000 + seed)
    torque += noise * np.sqrt(np.mean(torque**2)) * draw.normal(size=len(time))
    return time, np.array(rows), torque


def motion_of(log, purpose, driven=0):
    """Return the filtered motion of a log."""
    time, q, torque = log
    columns = {"time_s": time}
    joints = [{"name": name, "kind": "revolute"} for name in ("shoulder", "elbow")]
    for j, joint in enumerate(joints):
        columns[f"{joint['name']}_angle_rad"] = q[:, j]
        columns[f"{joint['name']}_torque_nm"] = torque if j == driven else np.zeros(len(time))
    joints[1 - driven]["drive"] = "none"
    metadata = {
        "contract": "recording/1",
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": 1.0 / (time[1] - time[0]),
        "joints": joints,
        "geometry": {"thigh_length_m": LENGTH, "gravity_m_s2": GRAVITY},
    }
    table = Table(pd.DataFrame(columns), metadata, Path(f"{purpose}.parquet"))
    return motion_from_table(motion_table(table, FilterSettings()))
