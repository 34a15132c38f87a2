"""Motions that labs use: multisines, the paper's two harmonics, ramps between holds, and a gait.

All stay within the paper's Table 2 (``excitation.py``). A motion is a sum of sines of a phase, or a
course between points; either repeats with a period, or does not.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind.excitation import (
    FASTEST,
    HIGHEST,
    LOWEST,
    MARGIN,
    STEEPEST,
    baseline_columns,
)
from tests.campaigns.blind.loop import LEAD_IN_S, TABLE_STEP_S

PAPER = Path(__file__).parents[3] / "datasets" / "paper" / "trajectory.toml"
FAMILIES = {"optimal": 0.34, "multisine": 0.26, "paper": 0.12, "ramps": 0.14, "gait": 0.14}
"""Kinds of motion and the shares of sessions that use them."""
ANOTHER_TO_VALIDATE = 0.3
"""Share of sessions that validate on a motion of another kind."""
PERIODS_S = (5.0, 20.0)
FEWEST_PERIODS = 2.5
"""Of a run that says its period."""
SLOWEST_S = 4.0
"""Period of the fastest harmonic of a multisine that is fast enough to be of use."""
FULL, GENTLE = 1.0, 0.6
"""How much of what the bounds allow a motion uses."""

State = tuple[NDArray, NDArray, NDArray]
"""Angle, velocity, acceleration, (n, 2) each."""


@dataclass(frozen=True)
class Trajectory:
    """A motion of hip and knee from ``-LEAD_IN_S`` on."""

    family: str
    period_s: float | None
    middle: NDArray
    """Where the machine starts from, (2,) rad."""
    at: Callable[[NDArray], State]

    def table(self, duration_s: float) -> NDArray:
        """Return angles and speeds (n, 4) each ``TABLE_STEP_S``."""
        n = round((LEAD_IN_S + duration_s) / TABLE_STEP_S) + 3
        q, dq, _ = self.at(np.arange(n) * TABLE_STEP_S - LEAD_IN_S)
        return np.ascontiguousarray(np.column_stack([q, dq]))


def random_trajectory(
    rng: Generator, duration_s: float, periodic: bool, family: str | None = None
) -> Trajectory:
    """Draw a motion for runs of this length, of this family or of any."""
    family = family or random_family(rng)
    longest = max(PERIODS_S[0], min(PERIODS_S[1], duration_s / FEWEST_PERIODS))
    period = float(rng.uniform(PERIODS_S[0], longest))
    draw = {
        "optimal": _optimal,
        "multisine": _multisine,
        "paper": _paper,
        "ramps": _ramps,
        "gait": _gait,
    }[family]
    middle, repeats_after, motion = draw(rng, period, duration_s, periodic)
    return Trajectory(family, repeats_after if periodic else None, middle, motion)


def random_family(rng: Generator) -> str:
    """Draw a kind of motion."""
    return str(rng.choice(list(FAMILIES), p=list(FAMILIES.values())))


def _within_bounds(
    rng: Generator, middle: NDArray, motion: Callable, duration_s: float
) -> Callable:
    """Scale a motion about its middle until it keeps the bounds, and often a little more."""
    t = np.arange(-LEAD_IN_S, duration_s, 0.02)
    q, dq, ddq = motion(t)
    room = np.minimum(
        (HIGHEST - middle) / np.maximum(q.max(axis=0), 1e-9),
        (LOWEST - middle) / np.minimum(q.min(axis=0), -1e-9),
    )
    most = np.min(
        [room, FASTEST / np.abs(dq).max(axis=0), STEEPEST / np.abs(ddq).max(axis=0)], axis=0
    )
    scale = MARGIN * most * rng.uniform(GENTLE, FULL)

    def scaled(t: NDArray) -> State:
        q, dq, ddq = motion(t)
        return middle + scale * q, scale * dq, scale * ddq

    return scaled


def _sines(omega: NDArray, a: NDArray, b: NDArray) -> Callable[[NDArray], State]:
    """Return sum of a sin + b cos; frequencies (2, m) of each joint, coefficients (2, m)."""

    def motion(t: NDArray) -> State:
        s, c = np.sin(t[:, None, None] * omega), np.cos(t[:, None, None] * omega)
        q = (a * s + b * c).sum(axis=2)
        dq = (omega * (a * c - b * s)).sum(axis=2)
        return q, dq, -(omega**2 * (a * s + b * c)).sum(axis=2)

    return motion


def _random_middle(rng: Generator) -> NDArray:
    return (LOWEST + HIGHEST) / 2 + rng.uniform(-0.3, 0.3, 2) * (HIGHEST - LOWEST) / 2


def _random_sines(rng: Generator, period: float, harmonics: int, periodic: bool) -> Callable:
    k = np.arange(1, harmonics + 1)
    omega = 2 * np.pi / period * np.tile(k, (2, 1)).astype(float)
    if not periodic:
        # Irrational steps from harmonic to harmonic: the motion never comes back.
        omega *= rng.uniform(0.85, 1.15, omega.shape)
    a, b = rng.normal(size=(2, 2, harmonics)) / np.sqrt(k) ** rng.uniform(0.5, 1.5)
    return _sines(omega, a, b)


def _random_harmonics(rng: Generator, period: float, fewest: int) -> int:
    """Draw a number of harmonics, the fastest of which takes ``SLOWEST_S`` at most."""
    return int(rng.integers(min(6, max(fewest, np.ceil(period / SLOWEST_S))), 7))


def _multisine(rng: Generator, period: float, duration_s: float, periodic: bool):
    middle, harmonics = _random_middle(rng), _random_harmonics(rng, period, 2)
    motion = _random_sines(rng, period, harmonics, periodic)
    return middle, period, _within_bounds(rng, middle, motion, duration_s)


def _optimal(rng: Generator, period: float, duration_s: float, periodic: bool, tries: int = 30):
    """Return the most informative of some random multisines."""
    harmonics, best, most = _random_harmonics(rng, period, 3), None, -np.inf
    t = np.arange(0.0, min(duration_s, 2 * period), 0.1)
    for _ in range(tries):
        middle = _random_middle(rng)
        motion = _random_sines(rng, period, harmonics, periodic)
        scaled = _within_bounds(rng, middle, motion, min(duration_s, 3 * period))
        q, dq, ddq = scaled(t)
        columns = baseline_columns(q, dq, ddq, 0.4, 9.81).reshape(-1, 8)
        information = float(np.linalg.slogdet(columns.T @ columns)[1])
        if information > most:
            best, most = (middle, motion), information
    middle, motion = best
    return middle, period, _within_bounds(rng, middle, motion, duration_s)


@cache
def _printed() -> dict:
    return tomllib.loads(PAPER.read_text())


def _paper(rng: Generator, period: float, duration_s: float, periodic: bool):
    """Return the paper's motion, whose hip is one sine; not as printed but for its phases and its
    pace."""
    printed = _printed()
    a, b = np.radians(printed["a"]), np.radians(printed["b"])
    middle = np.array(printed["theta0_rad"])
    pace = rng.uniform(1.0, 1.35) * printed["omega_rad_s"]
    omega = pace * np.tile([1.0, 2.0], (2, 1))
    turn = rng.uniform(-0.4, 0.4, (2, 1))
    a, b = a * np.cos(turn) - b * np.sin(turn), a * np.sin(turn) + b * np.cos(turn)
    if not periodic:
        omega = omega * rng.uniform(0.85, 1.15, omega.shape)
    return middle, 2 * np.pi / pace, _within_bounds(rng, middle, _sines(omega, a, b), duration_s)


def _ramps(rng: Generator, period: float, duration_s: float, periodic: bool):
    """Return smooth steps and ramps between random angles, with short holds."""
    middle = (LOWEST + HIGHEST) / 2
    length = max(period, 8.0) if periodic else LEAD_IN_S + duration_s + 2.0
    courses = [_course(rng, length, periodic) for _ in range(2)]

    def motion(t: NDArray) -> State:
        inside = np.mod(t, length) if periodic else t + LEAD_IN_S
        states = [_along(course, inside) for course in courses]
        return tuple(np.column_stack([s[i] for s in states]) for i in range(3))

    return middle, length, _within_bounds(rng, middle, motion, duration_s)


def _course(rng: Generator, length: float, closed: bool) -> tuple[NDArray, NDArray, float]:
    """Draw instants and angles between which a joint moves, and what share of a move speeds up or
    down."""
    moves = max(3, round(length / rng.uniform(1.3, 3.0)))
    durations = rng.uniform(0.5, 1.5, moves)
    holds = np.where(rng.random(moves) < 0.5, rng.uniform(0.05, 0.6, moves), 0.0)
    total = durations.sum() + holds.sum()
    durations, holds = durations * length / total, holds * length / total
    starts = np.concatenate([[0.0], np.cumsum(durations + holds)[:-1]])
    angles = np.empty(moves + 1)
    angles[0] = side = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0)
    for i in range(1, moves + 1):
        # Far enough to count: to the other side, or a good way on.
        side = (
            -np.sign(side) * rng.uniform(0.1, 1.0) if rng.random() < 0.8 else rng.uniform(-1.0, 1.0)
        )
        angles[i] = side
    if closed:
        angles[-1] = angles[0]
    return np.column_stack([starts, durations]), angles, float(rng.uniform(0.25, 0.5))


def _along(course: tuple[NDArray, NDArray, float], t: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Return angle, velocity and acceleration of one joint along its course."""
    times, angles, blend = course
    i = np.clip(np.searchsorted(times[:, 0], t, side="right") - 1, 0, len(times) - 1)
    start, duration = times[i, 0], times[i, 1]
    u = np.clip((t - start) / duration, 0.0, 1.0)
    share, speed, push = _smooth_trapezoid(u, blend)
    rise = angles[i + 1] - angles[i]
    return angles[i] + rise * share, rise * speed / duration, rise * push / duration**2


def _smooth_trapezoid(u: NDArray, blend: float) -> tuple[NDArray, NDArray, NDArray]:
    """Return a rise from 0 to 1, its slope and curvature: speed goes up and down as half a
    cosine."""
    top = 1.0 / (1.0 - blend)
    late = np.minimum(u, 1.0 - u)
    ramp = np.clip(late / blend, 0.0, 1.0)
    speed = top * 0.5 * (1.0 - np.cos(np.pi * ramp))
    push = top * 0.5 * np.pi / blend * np.sin(np.pi * ramp) * np.sign(0.5 - u) * (ramp < 1.0)
    early = top * 0.5 * (late - blend / np.pi * np.sin(np.pi * ramp) * 1.0)
    flat = top * (late - 0.5 * blend)
    rise = np.where(ramp < 1.0, early, flat)
    return np.where(u < 0.5, rise, 1.0 - rise), speed, push


def _gait(rng: Generator, period: float, duration_s: float, periodic: bool):
    """Return slow steps: the hip swings about once a stride, the knee bends little in stance and
    much in swing."""
    middle = np.array([0.55, -0.85])
    stride = rng.uniform(2.4, 5.5)
    hip = np.array([1.0, rng.uniform(0.1, 0.25), rng.uniform(0.0, 0.06), 0.0])
    knee = np.array([0.75, rng.uniform(0.4, 0.65), rng.uniform(0.05, 0.15), rng.uniform(0.0, 0.05)])
    size = np.stack([hip, knee])
    phase = np.array([[0.0, 0.9, 1.5, 0.0], [2.0, 0.2, 2.4, 1.0]]) + rng.uniform(-0.2, 0.2, (2, 4))
    k = np.arange(1, 5)
    wander = np.zeros(2) if periodic else rng.uniform(0.15, 0.3, 2)
    slow = 2 * np.pi * rng.uniform(0.04, 0.09, 2)

    def motion(t: NDArray) -> State:
        base = 2 * np.pi / stride
        # An unsteady walker: the phase runs ahead and falls back.
        phi = base * t + (wander / slow * np.sin(np.outer(t, slow))).sum(axis=1)
        pace = base + (wander * np.cos(np.outer(t, slow))).sum(axis=1)
        change = -(wander * slow * np.sin(np.outer(t, slow))).sum(axis=1)
        angle = phi[:, None, None] * k + phase
        s, c = np.sin(angle), np.cos(angle)
        first = (size * k * -s).sum(axis=2)
        second = (size * k**2 * -c).sum(axis=2)
        q = (size * c).sum(axis=2)
        return q, first * pace[:, None], second * (pace**2)[:, None] + first * change[:, None]

    return middle, stride, _within_bounds(rng, middle, motion, duration_s)
