"""Speed of ``exoid simulate``: the compiled adaptive loop against scipy's solve_ivp and against the
clock.

Run with ``python -m tests.campaigns.bench.bench_simulate``.
Times are processor time of one thread, so that a
busy machine does not decide. solve_ivp integrates the same loop (reference case, Table 3) with the
loosest tolerance that is as accurate.
"""

import time
from collections.abc import Callable, Iterator
from math import copysign, cos, exp, pi, sin

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from pipelines.contracts import HIP_AND_KNEE
from pipelines.dynamics.pd_loop import follow, loop_at_rest, make_drives
from pipelines.dynamics.plant import Plant, make_plant
from pipelines.dynamics.replay import replay
from pipelines.dynamics.tracking import track
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.mechanics.gait import gait
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.motion import Motion
from pipelines.model import Model, Term
from pipelines.settings.simulate import SimulateSettings
from pipelines.signals.low_pass import derivative, low_pass
from tests.campaigns.bench.report import Row, show

SECONDS = 10.0
X = (10.3016, 3.0157, 2.2664, 5.5354)
COULOMB, VISCOUS = (2.6596, 4.7197), (4.14895, 7.3602)
TOLERANCES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8)


def rates(t, y):
    """The whole loop as one would write it for solve_ivp; y is q, dq and seven weights of hip and
    of knee."""
    out = np.zeros(18)
    wanted = (
        (
            0.18 + 0.40 * cos(pi * t - 0.2) - 0.06 * cos(2 * pi * t + 0.6),
            -0.40 * pi * sin(pi * t - 0.2) + 0.12 * pi * sin(2 * pi * t + 0.6),
            -0.40 * pi**2 * cos(pi * t - 0.2) + 0.24 * pi**2 * cos(2 * pi * t + 0.6),
        ),
        (
            -0.46
            - 0.28 * cos(pi * t + 1.8)
            - 0.24 * cos(2 * pi * t + 2.6)
            - 0.06 * cos(3 * pi * t + 3.0),
            0.28 * pi * sin(pi * t + 1.8)
            + 0.48 * pi * sin(2 * pi * t + 2.6)
            + 0.18 * pi * sin(3 * pi * t + 3.0),
            pi**2
            * (
                0.28 * cos(pi * t + 1.8)
                + 0.96 * cos(2 * pi * t + 2.6)
                + 0.54 * cos(3 * pi * t + 3.0)
            ),
        ),
    )
    push = [0.0, 0.0]
    for j in range(2):
        q, dq, ddq = wanted[j]
        e, de = q - y[j], dq - y[2 + j]
        r = de + 10.0 * e
        network = 0.0
        for i in range(7):
            c = -1.5 + 0.5 * i
            squares = (e - c) ** 2 + (de - c) ** 2 + (q - c) ** 2 + (dq - c) ** 2 + (ddq - c) ** 2
            activation = exp(-squares / 100.0)
            network += y[4 + 7 * j + i] * activation
            out[4 + 7 * j + i] = 500.0 * activation * r
        torque = network + 300.0 * r + copysign(0.3, r)
        if abs(torque) >= 200.0:
            torque = 200.0 if torque > 0 else -200.0
            out[4 + 7 * j : 11 + 7 * j] = 0.0
        v = y[2 + j]
        push[j] = torque - 2.0 * sin(2.0 * t) - copysign(COULOMB[j], v) - VISCOUS[j] * v
    coupling, h = X[2] * 0.38952 * cos(y[1]), X[2] * 0.38952 * sin(y[1])
    shank = 9.8 * X[2] * sin(y[0] + y[1])
    hip = push[0] + h * (2 * y[2] + y[3]) * y[3] - 9.8 * X[3] * sin(y[0]) - shank
    knee = push[1] - h * y[2] ** 2 - shank
    m11, m12, m22 = X[0] + 2 * coupling, X[1] + coupling, X[1]
    determinant = m11 * m22 - m12**2
    out[0], out[1] = y[2], y[3]
    out[2], out[3] = (m22 * hip - m12 * knee) / determinant, (m11 * knee - m12 * hip) / determinant
    return out


def plant() -> Plant:
    """Return the leg of Table 3."""
    frictions = zip(("hip", "knee"), COULOMB, VISCOUS, strict=True)
    terms = (
        Term(Friction(joint), np.array([coulomb, viscous])) for joint, coulomb, viscous in frictions
    )
    return make_plant(
        Model((Term(RigidBody(), np.array(X)), *terms)), Geometry(), HIP_AND_KNEE, "with_human"
    )


def rows() -> Iterator[Row]:
    """Measure."""
    yield from loop_rows()
    yield from replay_rows()


def loop_rows() -> Iterator[Row]:
    """The reference case, 10 s: exoid, then solve_ivp."""
    leg, settings = plant(), SimulateSettings()
    found = track(leg, settings, gait())
    truth = track(leg, settings.model_copy(update={"step_s": 1e-5}), gait()).run.angle[::100]
    error = np.abs(found.run.angle - truth).max()
    ours = fastest(lambda: track(leg, settings, gait()), 15)
    yield Row("adaptive loop, 10 s at 1 kHz", f"{1e3 * ours:.1f} ms, error {1e6 * error:.0f} µrad")
    yield Row("  times real time", f"{SECONDS / ours:.0f} x", SECONDS / ours, "300")
    compiled = njit(rates)
    tolerance, reached = tolerance_for(compiled, error, truth)
    theirs = fastest(lambda: integrate(rates, tolerance), 2)
    yield Row(
        f"solve_ivp, rtol {tolerance:g}",
        f"{theirs:.2f} s, error {1e6 * reached:.0f} µrad",
        theirs / ours,
        "50",
    )
    helped = fastest(lambda: integrate(compiled, tolerance), 2)
    yield Row("solve_ivp, its equations compiled too", f"{helped:.2f} s", helped / ours)


def tolerance_for(function: Callable, error: float, truth: np.ndarray) -> tuple[float, float]:
    """Return the loosest tolerance that is as accurate, and its error; the tightest where none
    is."""
    for tolerance in TOLERANCES:
        reached = np.abs(integrate(function, tolerance) - truth).max()
        if reached <= error:
            break
    return tolerance, reached


def integrate(function: Callable, tolerance: float) -> np.ndarray:
    """Return the angles at every millisecond, (10001, 2) rad."""
    at = np.arange(round(SECONDS * 1000) + 1) / 1000
    return (
        solve_ivp(
            function, (0.0, SECONDS), np.zeros(18), "RK45", at, rtol=tolerance, atol=tolerance
        )
        .y[:2]
        .T
    )


def replay_rows() -> Iterator[Row]:
    """All windows of a run of 40 s."""
    leg, rate = plant(), 200.0
    t = (np.arange(8000) + 0.5) / rate
    reference = gait().at(0.3 * t)[0]
    drives = make_drives(
        np.full(2, 2000.0), np.full(2, 150.0), np.full(2, 200.0), np.zeros(2), 1000.0, rate
    )
    angle, _, torque, _ = follow(
        leg.assembly, drives, loop_at_rest(leg.assembly, reference[0]), reference, 0.0
    )
    q = low_pass(angle, rate, 12.0)
    motion = Motion(
        t,
        q,
        derivative(q, rate, 1),
        derivative(q, rate, 2),
        torque,
        np.zeros(8000, dtype=np.int64),
        np.ones(8000, dtype=bool),
        run="with_human",
    )
    windows = len(replay(leg.model, motion).first)
    yield Row(
        f"replay of 40 s, {windows} windows of 1 s",
        f"{1e3 * fastest(lambda: replay(leg.model, motion), 9):.1f} ms",
    )


def fastest(work: Callable[[], object], rounds: int) -> float:
    """Return the processor time of this thread in the fastest of several rounds, s."""
    times = []
    for _ in range(rounds):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return min(times)


if __name__ == "__main__":
    show("exoid simulate", rows())
