"""Machines of one joint, simulated without any of exoid's equations, as recordings."""

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from pipelines.contracts.table import Table
from tests.once import once

RATE_HZ, PERIOD_S = 250.0, 5.0


def excitation(seed, size):
    """Return a reference and its rate as functions of time: five harmonics of 0.2 Hz."""
    draw, w = np.random.default_rng(seed), 2 * np.pi / PERIOD_S
    a, b = (size * draw.normal(0, 1, 5) / np.arange(1, 6) for _ in range(2))
    n = np.arange(1, 6)[:, np.newaxis]

    def reference(t):
        t = np.atleast_1d(t)
        return a @ np.sin(n * w * t) + b @ np.cos(n * w * t)

    def rate(t):
        t = np.atleast_1d(t)
        return (a * n[:, 0] * w) @ np.cos(n * w * t) - (b * n[:, 0] * w) @ np.sin(n * w * t)

    return reference, rate


def moved(reference, rate, kp, kd, acceleration, seconds):
    """Return times, positions and drive torques of a machine under proportional and derivative
    feedback."""

    def force(t, x, v):
        return kp * (reference(t)[0] - x) + kd * (rate(t)[0] - v)

    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    path = solve_ivp(
        lambda t, s: [s[1], acceleration(s[0], s[1], force(t, *s))],
        (0, seconds),
        [reference(0.0)[0], rate(0.0)[0]],
        t_eval=time,
        method="RK23",
        rtol=1e-5,
        atol=1e-7,
        max_step=0.01,
    )
    return (
        time,
        path.y[0],
        np.array([force(t, x, v) for t, x, v in zip(time, *path.y, strict=True)]),
    )


def table(time, position, torque, joint, purpose, **geometry):
    """Return a ``recording/1`` table of one joint, ``{"name": ..., "kind": ...}``."""
    angle, force = (
        ("position_m", "force_n") if joint["kind"] == "prismatic" else ("angle_rad", "torque_nm")
    )
    frame = pd.DataFrame(
        {"time_s": time, f"{joint['name']}_{angle}": position, f"{joint['name']}_{force}": torque}
    )
    metadata = {
        "contract": "recording/1",
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": RATE_HZ,
        "period_s": PERIOD_S,
        "joints": [joint],
        "geometry": geometry,
    }
    return Table(frame, metadata, None)


@once
def pendulum(purpose, seed, spring=0.0, asymmetry=0.0, seconds=25.0):
    """A small servo: 0.5 kg at 0.25 m, 30 g·m², with a spring of so many N·m/rad about 0.3 rad.

    Forwards it has so many N·m·s/rad more of viscous friction than backwards.
    """
    reference, rate = excitation(seed, 0.8)

    def acceleration(q, v, torque):
        friction = 0.04 * np.tanh(v / 0.005) + 0.05 * v + 0.5 * asymmetry * abs(v)
        return (torque - friction - 0.5 * 9.81 * 0.25 * np.sin(q) - spring * (q - 0.3)) / 0.03

    time, q, torque = moved(reference, rate, 20.0, 0.6, acceleration, seconds)
    noise = np.random.default_rng(seed).normal(0, 0.01, len(time))
    return table(
        time, q, torque + noise, {"name": "arm", "kind": "revolute"}, purpose, gravity_m_s2=9.81
    )


@once
def slide(purpose, seed, asymmetry=0.0, seconds=25.0):
    """A ball screw: 90 kg, 200 N·s/m and so much more of it forwards than backwards, 20 N of dry
    friction."""
    reference, rate = excitation(seed, 0.06)

    def acceleration(x, v, force):
        friction = 20.0 * np.tanh(v / 0.001) + 200.0 * v + 0.5 * asymmetry * abs(v)
        return (force - friction) / 90.0

    time, x, force = moved(reference, rate, 2e5, 6e3, acceleration, seconds)
    noise = np.random.default_rng(seed).normal(0, 0.5, len(time))
    return table(time, x, force + noise, {"name": "axis", "kind": "prismatic"}, purpose)


@once
def lift(purpose, seed, spring=0.0, seconds=25.0):
    """A lift of 12 kg without a counterweight, with a spring of so many N/m about 0.02 m."""
    reference, rate = excitation(seed, 0.03)

    def acceleration(x, v, force):
        friction = 9.0 * np.tanh(v / 0.005) + 30.0 * v
        return (force - friction - 12.0 * 9.81 - spring * (x - 0.02)) / 12.0

    time, x, force = moved(reference, rate, 9000.0, 400.0, acceleration, seconds)
    noise = np.random.default_rng(seed).normal(0, 0.5, len(time))
    return table(
        time,
        x,
        force + noise,
        {"name": "carriage", "kind": "prismatic"},
        purpose,
        gravity_m_s2=9.81,
    )


def driven(purpose, seed, kind, more, seconds=40.0, news=0.1):
    """Return what a drive exerts to take an arm of 0.6 kg·m, or a lift of 12 kg, along a path, and
    more than that.

    ``more(t, q, dq, ddq, torque)`` is in N·m, or in 20 N at the lift, whose q is in 0.1 m. Noise
    lasts for some samples; ``news`` is what each adds, in the same units.
    """
    draw = np.random.default_rng(seed)
    reference, rate = excitation(draw.integers(10**6), 0.6)
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    q, dq = reference(time), rate(time)
    ddq = (rate(time + 1e-5) - rate(time - 1e-5)) / 2e-5
    dry = 1.2 * np.tanh(dq / 0.01) + 0.8 * dq
    own = (
        0.3 * ddq + 0.6 * 9.81 * np.sin(q) + dry
        if kind == "revolute"
        else 0.06 * ddq + 0.6 * 9.81 + dry
    )
    torque = (
        own
        + more(time, q, dq, ddq, own)
        + lfilter([news], [1.0, -0.9], draw.normal(size=len(time)))
    )
    if kind == "revolute":
        return table(time, q, torque, {"name": "arm", "kind": kind}, purpose, gravity_m_s2=9.81)
    return table(
        time, 0.1 * q, 20.0 * torque, {"name": "carriage", "kind": kind}, purpose, gravity_m_s2=9.81
    )
