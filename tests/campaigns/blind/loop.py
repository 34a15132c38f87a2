"""The compiled loop: MuJoCo's leg under sampled PD drives, with sticking friction and whatever is
hidden.

Velocities are stepped first, positions with the new velocity (symplectic Euler); viscous friction
is implicit. Dry friction is an impulse within its levels that stops the joint if it can (Moreau,
1988), found by projected Gauss-Seidel over both joints.
"""

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from tests.campaigns.blind.body import PAYLOAD_INERTIA, evaluate
from tests.campaigns.blind.compiled import njit
from tests.campaigns.blind.dry import dry_levels, is_dry
from tests.campaigns.blind.encoders import WAVES, reading, slope
from tests.campaigns.blind.smooth import smooth_torque
from tests.campaigns.blind.transmissions import RIGID, transmitted

DT = 0.25e-3
STEPS_PER_TICK = 4
TICKS_PER_SAMPLE = 5
SAMPLE_S = DT * STEPS_PER_TICK * TICKS_PER_SAMPLE
LEAD_IN_S = 5.0
"""From rest into the periodic motion before anything is recorded."""
BLEND_S = 3.0
TABLE_STEP_S = 0.02


class Excited(NamedTuple):
    """Fourier coefficients, (2,), (2, n), (2, n); or, where there is one, a table of the motion.

    ``table`` (m, 4): angles and speeds of hip and knee each ``TABLE_STEP_S`` from ``-LEAD_IN_S``
    on.
    """

    theta0: np.ndarray
    a: np.ndarray
    b: np.ndarray
    omega: float
    table: np.ndarray


class Drives(NamedTuple):
    """PD loops and encoders, arrays (2,).

    ``wobble`` (2, 6): amplitude and phase of the encoders' errors once, twice, three times a turn.
    """

    kp: np.ndarray
    kd: np.ndarray
    limit: np.ndarray
    count: np.ndarray
    offset: np.ndarray
    wobble: np.ndarray
    speed_share: float
    recorded_count: np.ndarray


class Joints(NamedTuple):
    """Friction and transmission, arrays (2,), ``added_mass`` (2, 2), ``spring`` (2, 5).

    ``cuffs`` (2, 3) for thigh and shank: stiffness (N/m), damping (N·s/m), hardening (1/m²);
    ``levers`` (3,): distance of each cuff from its joint, thigh length.
    """

    coulomb: np.ndarray
    viscous: np.ndarray
    added_mass: np.ndarray
    transmission: np.ndarray
    motor_inertia: np.ndarray
    spring: np.ndarray
    cuffs: np.ndarray
    levers: np.ndarray


class World(NamedTuple):
    """What is outside the leg: tilt of gravity (base, sway, Hz), payload (body, mass, start, ramp,
    direction)."""

    gravity: float
    tilt: np.ndarray
    payload: np.ndarray


class Hidden(NamedTuple):
    """Hidden torques, one row each."""

    kind: np.ndarray
    joint: np.ndarray
    human: np.ndarray
    p: np.ndarray
    memory: np.ndarray
    table: np.ndarray


class Log(NamedTuple):
    """What happened. Samples of 5 ms, latched in their middle: (n, 2); drive torque by ticks of 1
    ms."""

    reading: np.ndarray
    """Counted angle, rad."""
    angle: np.ndarray
    """Uncounted reading of the encoder."""
    speed: np.ndarray
    acceleration: np.ndarray
    """Mean over the sample's window."""
    link: np.ndarray
    """(n, 6): q, dq, ddq of hip and knee of the machine's links."""
    cuff: np.ndarray
    """(n, 2) force across thigh and shank where the wearer is a leg of their own, N."""
    human: np.ndarray
    """Hidden torque on the human side."""
    reference: np.ndarray
    drive_speed: np.ndarray
    torque: np.ndarray
    """(5 n, 2)."""


@njit()
def tabulated(table, t, j):
    """Angle of joint ``j`` at time ``t``, by cubic Hermite interpolation of angles and speeds."""
    place = min(max((t + LEAD_IN_S) / TABLE_STEP_S, 0.0), len(table) - 1.001)
    i = int(place)
    f = place - i
    q0, q1 = table[i, j], table[i + 1, j]
    v0, v1 = table[i, 2 + j] * TABLE_STEP_S, table[i + 1, 2 + j] * TABLE_STEP_S
    rise = q1 - q0
    return q0 + f * (v0 + f * (3.0 * rise - 2.0 * v0 - v1 + f * (v0 + v1 - 2.0 * rise)))


@njit()
def reference_at(x, t, out):
    """Set-point at time ``t``, a smooth start from the mean angle before time 0."""
    s = min(1.0, max(0.0, (t + LEAD_IN_S - 0.5) / BLEND_S))
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    if len(x.table) > 0:
        for j in range(2):
            out[j] = x.theta0[j] + share * (tabulated(x.table, t, j) - x.theta0[j])
        return
    for j in range(2):
        swing = 0.0
        for k in range(x.a.shape[1]):
            phase = (k + 1) * x.omega * t
            swing += x.a[j, k] * sin(phase) + x.b[j, k] * cos(phase)
        out[j] = x.theta0[j] + share * swing


@njit()
def _press(jt, z, u, force, pressed):
    """Let the machine's cuffs push the wearer's leg (coordinates 2 and 3): forces across thigh and
    shank."""
    thigh, shank, length = jt.levers
    bend = length * cos(z[1])
    hip, knee = z[0] - z[2], z[1] - z[3]
    hip_rate, knee_rate = u[0] - u[2], u[1] - u[3]
    for i in range(2):
        way = thigh * hip if i == 0 else bend * hip + shank * (hip + knee)
        rate = thigh * hip_rate if i == 0 else bend * hip_rate + shank * (hip_rate + knee_rate)
        pressed[i] = (
            jt.cuffs[i, 0] * way * (1.0 + jt.cuffs[i, 2] * way * way) + jt.cuffs[i, 1] * rate
        )
    at_hip = thigh * pressed[0] + (bend + shank) * pressed[1]
    at_knee = shank * pressed[1]
    force[2] += at_hip
    force[3] += at_knee
    force[0] -= at_hip
    force[1] -= at_knee


@njit()
def _solve(A, b, n, x):
    """Solve A x = b in place for up to five unknowns; A symmetric and positive definite."""
    for i in range(n):
        for k in range(i + 1, n):
            f = A[k, i] / A[i, i]
            if f != 0.0:
                for c in range(i, n):
                    A[k, c] -= f * A[i, c]
                for c in range(b.shape[1]):
                    b[k, c] -= f * b[i, c]
    for c in range(b.shape[1]):
        for i in range(n - 1, -1, -1):
            total = b[i, c]
            for k in range(i + 1, n):
                total -= A[i, k] * x[k, c]
            x[i, c] = total / A[i, i]


@njit()
def _set_world(h, w, t):
    """Turn gravity and load the payload as they are at time ``t``."""
    mass, subtree, inertia, gravity = h[9:]
    tilt = w.tilt[0] + w.tilt[1] * sin(2.0 * pi * w.tilt[2] * t)
    gravity[0], gravity[2] = -w.gravity * sin(tilt), -w.gravity * cos(tilt)
    body = int(w.payload[0])
    if body >= 0:
        share = min(1.0, max(0.0, (t - w.payload[2]) / w.payload[3]))
        lump = max(1e-9, w.payload[1] * (share if w.payload[4] > 0 else 1.0 - share))
        subtree[:] += lump - mass[body]
        mass[body] = lump
        inertia[body, :] = lump * PAYLOAD_INERTIA


@njit()
def simulate(h, x, d, jt, w, hid, start, samples, ticks, with_drives, out):
    """Run the leg from rest at ``start`` (2,) and log ``samples`` samples of ``ticks`` ms into
    ``out``.

    Without drives there is no lead-in and no torque: the leg swings freely.
    """
    sample_s = DT * STEPS_PER_TICK * ticks
    model, data, qpos, qvel, _, bias, M, pattern, columns = h[:9]
    nv = len(qpos)
    soft = np.where(jt.transmission != RIGID)[0]
    n = nv + len(soft)
    place = np.arange(2)
    for i in range(len(soft)):
        place[soft[i]] = nv + i
    z, u = np.zeros(n), np.zeros(n)
    for i in range(nv):
        z[i] = start[i % 2]
    for i in range(len(soft)):
        z[nv + i] = start[soft[i]]
    A, B, V = np.zeros((n, n)), np.zeros((n, 3)), np.zeros((n, 3))
    force, before = np.zeros(n), np.zeros(n)
    dense = np.zeros((nv, nv))
    q, v, a = np.zeros(2), np.zeros(2), np.zeros(2)
    th, om = np.zeros(2), np.zeros(2)
    ref, old_ref, drive = np.zeros(2), np.zeros(2), np.zeros(2)
    angle, speed = np.zeros(2), np.zeros(2)
    up, down, lam, load, human = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    opened, pressed = np.zeros(n), np.zeros(2)
    first = -round(LEAD_IN_S / sample_s) if with_drives else 0
    reference_at(x, first * sample_s, old_ref)
    for j in range(2):
        angle[j] = reading(d.offset[j], d.wobble[j], z[place[j]])
    half = STEPS_PER_TICK * ticks // 2
    for k in range(first, samples):
        opened[:] = u
        for s in range(STEPS_PER_TICK * ticks):
            t = k * sample_s + s * DT
            if s == 0:
                _set_world(h, w, t)
            if with_drives and s % STEPS_PER_TICK == 0:
                tick = STEPS_PER_TICK * DT
                reference_at(x, t, ref)
                for j in range(2):
                    seen = reading(d.offset[j], d.wobble[j], z[place[j]])
                    if d.count[j] > 0.0:
                        seen = d.count[j] * np.round(seen / d.count[j])
                    speed[j] += d.speed_share * ((seen - angle[j]) / tick - speed[j])
                    angle[j] = seen
                    wanted = d.kp[j] * (ref[j] - seen) + d.kd[j] * (
                        (ref[j] - old_ref[j]) / tick - speed[j]
                    )
                    drive[j] = min(d.limit[j], max(-d.limit[j], wanted))
                    old_ref[j] = ref[j]
                if k >= 0:
                    out.torque[k * ticks + s // STEPS_PER_TICK] = drive
            for i in range(nv):
                # Speeds belong half a step before the positions; Coriolis torque wants both at one
                # instant.
                qpos[i], qvel[i] = z[i], 1.5 * u[i] - 0.5 * before[i]
            evaluate(model, data, bias)
            for i in range(nv):
                for c in range(pattern[1, i]):
                    at = pattern[0, i] + c
                    dense[i, columns[at]] = M[at]
                    dense[columns[at], i] = M[at]
            for j in range(2):
                q[j], v[j] = z[j], u[j]
                th[j], om[j] = z[place[j]], u[place[j]]
            A[:] = 0.0
            A[:nv, :nv] = dense
            force[:] = 0.0
            for i in range(nv):
                force[i] = -bias[i]
            for j in range(2):
                for c in range(2):
                    A[j, c] += jt.added_mass[j, c]
                force[place[j]] += drive[j]
                up[j] = down[j] = jt.coulomb[j]
                human[j] = 0.0
                if place[j] != j:
                    A[place[j], place[j]] += jt.motor_inertia[j]
                    passed = transmitted(
                        int(jt.transmission[j]), jt.spring[j], th[j] - q[j], om[j] - v[j]
                    )
                    force[j] += passed
                    force[place[j]] -= passed
            if nv == 4:
                _press(jt, z, u, force, pressed)
            for i in range(len(hid.kind)):
                j = hid.joint[i]
                if is_dry(hid.kind[i]):
                    more, less = dry_levels(
                        hid.kind[i], hid.p[i], hid.table[i], t, j, th[j], q[1 - j], om, load
                    )
                    up[j] += more
                    down[j] += less
                elif hid.human[i]:
                    extra = smooth_torque(
                        hid.kind[i], hid.p[i], hid.memory[i], hid.table[i], t, DT, j, q, v, a
                    )
                    human[j] += extra
                    force[j + 2 if nv == 4 else j] -= extra
                else:
                    force[place[j]] -= smooth_torque(
                        hid.kind[i], hid.p[i], hid.memory[i], hid.table[i], t, DT, j, th, om, a
                    )
            # Momentum before, plus impulses; and the answer to a unit impulse at each motor.
            B[:] = 0.0
            for i in range(n):
                for c in range(n):
                    B[i, 0] += A[i, c] * u[c]
                B[i, 0] += DT * force[i]
                before[i] = u[i]
            for j in range(2):
                A[place[j], place[j]] += DT * jt.viscous[j]
                B[place[j], 1 + j] = 1.0
            _solve(A, B, n, V)
            _grip(V, place, up, down, om, lam)
            for i in range(n):
                u[i] = V[i, 0] - V[i, 1] * lam[0] - V[i, 2] * lam[1]
            for j in range(2):
                a[j] = (u[j] - before[j]) / DT
                inert = (
                    jt.motor_inertia[j] * (u[place[j]] - before[place[j]]) / DT
                    if place[j] != j
                    else 0.0
                )
                load[j] = drive[j] - lam[j] / DT - jt.viscous[j] * u[place[j]] - inert
            if k >= 0 and s == half:
                # Kicks come at the beginning of a step, where the drive's torque is spread over it:
                # half a
                # step back, where the last speeds are, motion and torque belong together.
                _latch(out, k, z, before, place, d, human, ref, speed, pressed)
            for i in range(n):
                z[i] += DT * u[i]
        if k >= 0:
            for j in range(2):
                mean = (u[place[j]] - opened[place[j]]) / sample_s
                bent = 0.0
                for n_waves in range(1, WAVES + 1):
                    size = n_waves * d.wobble[j, 2 * n_waves - 2]
                    at = n_waves * z[place[j]] + d.wobble[j, 2 * n_waves - 1]
                    bent += size * (cos(at) * mean - n_waves * sin(at) * u[place[j]] ** 2)
                out.acceleration[k, j] = mean + bent
            for i in range(2):
                out.link[k, 4 + i] = (u[i] - opened[i]) / sample_s


@njit()
def _grip(V, place, up, down, speed, lam):
    """Find the friction impulses ``lam`` (2,) within their levels that leave each joint stuck or
    opposed."""
    for j in range(2):
        lam[j] = DT * (max(0.0, up[j]) if speed[j] > 0 else -max(0.0, down[j]))
    for _ in range(25):
        change = 0.0
        for j in range(2):
            ahead = V[place[j], 0] - V[place[j], 1] * lam[0] - V[place[j], 2] * lam[1]
            held = lam[j] + ahead / V[place[j], 1 + j]
            new = min(DT * max(0.0, up[j]), max(-DT * max(0.0, down[j]), held))
            change = max(change, abs(new - lam[j]))
            lam[j] = new
        if change < 1e-10:
            break


@njit()
def _latch(out, k, z, u, place, d, human, ref, speed, pressed):
    """Log what is measured: positions half a step back, and the speeds ``u`` of that moment."""
    for j in range(2):
        theta = z[place[j]] - 0.5 * DT * u[place[j]]
        seen = reading(d.offset[j], d.wobble[j], theta)
        out.angle[k, j] = seen
        count = d.recorded_count[j]
        out.reading[k, j] = count * np.round(seen / count) if count > 0.0 else seen
        out.speed[k, j] = u[place[j]] * slope(d.wobble[j], theta)
        out.human[k, j] = human[j]
        out.reference[k, j] = ref[j]
        out.drive_speed[k, j] = speed[j]
        out.cuff[k, j] = pressed[j]
        out.link[k, j] = z[j] - 0.5 * DT * u[j]
        out.link[k, 2 + j] = u[j]
