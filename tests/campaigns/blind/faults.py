"""Faults of acquisition: what can go wrong between a sound leg and its file.

Each takes the columns of one run and changes them in place; ``everywhere`` marks those of the
wiring, which are the same in all runs. ``words`` are what an honest description would say, in any
form.
"""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from tests.campaigns.blind.plan import JOINTS

Columns = dict[str, np.ndarray]
WORDS = {
    "gap": ("gap", "missing"),
    "stuck_encoder": ("stuck", "frozen", "constant", "does not change"),
    "saturated_torque": ("satur", "clip", "limit"),
    "swapped_joints": ("swap", "exchang"),
    "degrees": ("degree",),
    "torque_in_another_unit": ("unit", "factor", "scale"),
    "sign_flipped": ("sign", "revers", "flip", "invert"),
    "clock_jitter": ("jitter", "clock", "irregular", "uneven"),
    "repeated_samples": ("repeat", "duplicate", "stale"),
    "dropped_samples": ("drop", "missing", "gap", "lost"),
}


def gap(columns: Columns, rng: Generator, joint: int) -> str | None:
    """A second or two of the run is not there."""
    n = len(columns["time_s"])
    start, length = int(rng.uniform(0.2, 0.7) * n), int(rng.uniform(150, 500))
    _keep(columns, np.r_[0:start, start + length : n])
    return None


def stuck_encoder(columns: Columns, rng: Generator, joint: int) -> str | None:
    """An angle stays what it was for some seconds, while the leg moves on."""
    name = f"{JOINTS[joint]}_angle_rad"
    n = len(columns[name])
    start, length = int(rng.uniform(0.1, 0.7) * n), int(rng.uniform(300, 1200))
    columns[name][start : start + length] = columns[name][start]
    return name


def saturated_torque(columns: Columns, rng: Generator, joint: int) -> str | None:
    """The current sensor clips."""
    name = f"{JOINTS[joint]}_torque_nm"
    limit = np.quantile(np.abs(columns[name]), rng.uniform(0.8, 0.92))
    columns[name][:] = np.clip(columns[name], -limit, limit)
    return name


def swapped_joints(columns: Columns, rng: Generator, joint: int) -> str | None:
    """The torques of hip and knee stand under each other's names."""
    hip, knee = "hip_torque_nm", "knee_torque_nm"
    columns[hip], columns[knee] = columns[knee], columns[hip]
    return None


def degrees(columns: Columns, rng: Generator, joint: int) -> str | None:
    """One joint's angle is in degrees."""
    name = f"{JOINTS[joint]}_angle_rad"
    columns[name][:] = np.degrees(columns[name])
    return name


def torque_in_another_unit(columns: Columns, rng: Generator, joint: int) -> str | None:
    """Torque in N·cm, or in kgf·m."""
    name = f"{JOINTS[joint]}_torque_nm"
    columns[name] *= rng.choice([100.0, 1 / 9.80665])
    return name


def sign_flipped(columns: Columns, rng: Generator, joint: int) -> str | None:
    """One joint's torque counts the other way."""
    name = f"{JOINTS[joint]}_torque_nm"
    columns[name] *= -1.0
    return name


def clock_jitter(columns: Columns, rng: Generator, joint: int) -> str | None:
    """Stamps of a host that was busy: late by up to most of a sample."""
    period = np.median(np.diff(columns["time_s"]))
    late = np.minimum(rng.exponential(0.2, len(columns["time_s"])), 0.9) * period
    columns["time_s"] += late
    return "time_s"


def repeated_samples(columns: Columns, rng: Generator, joint: int) -> str | None:
    """A bus that hands out old values: now and then a sample's measurements are the last one's."""
    stale = np.flatnonzero(rng.random(len(columns["time_s"])) < rng.uniform(0.05, 0.2))
    for k in stale[stale > 0]:
        for name in columns:
            if name not in ("time_s", "sequence"):
                columns[name][k] = columns[name][k - 1]
    return None


def dropped_samples(columns: Columns, rng: Generator, joint: int) -> str | None:
    """Single samples are lost here and there."""
    kept = np.flatnonzero(rng.random(len(columns["time_s"])) > rng.uniform(0.01, 0.05))
    _keep(columns, kept)
    return None


def _keep(columns: Columns, rows: np.ndarray) -> None:
    for name in columns:
        columns[name] = columns[name][rows]


Fault = Callable[[Columns, Generator, int], str | None]
FAULTS: tuple[Fault, ...] = (
    gap,
    stuck_encoder,
    saturated_torque,
    swapped_joints,
    degrees,
    torque_in_another_unit,
    sign_flipped,
    clock_jitter,
    repeated_samples,
    dropped_samples,
)
IN_EVERY_RUN = ("swapped_joints", "torque_in_another_unit", "sign_flipped")
"""Wiring and configuration are the same in all runs of a session."""


def fault_named(name: str) -> Fault:
    """Look a fault up by its name."""
    return next(fault for fault in FAULTS if fault.__name__ == name)
