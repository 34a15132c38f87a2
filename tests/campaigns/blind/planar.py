"""World *planar*: closed-form dynamics, friction of bristles, drives in cascade, current sampled at
instants.

Nothing here comes from MuJoCo. Joints have LuGre friction, whose bristles bend a little before a
joint slides (Canudas de Wit, Olsson, Astrom, Lischinsky, 1995, IEEE TAC 40(3)). A drive has a
position loop around a velocity loop with integrator, at a rate of its own, and estimates velocity
from counts. The torque is what the current was at an instant.
"""

from dataclasses import dataclass, replace
from math import exp, sin
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.campaigns.blind import two_link
from tests.campaigns.blind.body import Leg, Segment
from tests.campaigns.blind.channel import through
from tests.campaigns.blind.compiled import njit
from tests.campaigns.blind.conditions import Conditions
from tests.campaigns.blind.dry import dry_levels, is_dry
from tests.campaigns.blind.encoders import curvature, reading, slope
from tests.campaigns.blind.legs import Reported, check, cuff_forces, links_of, needed
from tests.campaigns.blind.loop import LEAD_IN_S, Excited, reference_at
from tests.campaigns.blind.plan import HIP, Plan, Run
from tests.campaigns.blind.recorded import Recorded, Rig
from tests.campaigns.blind.smooth import smooth_torque
from tests.campaigns.blind.trajectories import Trajectory
from tests.campaigns.blind.transmissions import RIGID, per_metre, press, transmitted

DT = 0.25e-3
STEPS_PER_MS = 4
DRIVE_RATES_HZ = (500.0, 1000.0, 2000.0, 4000.0)
KNEE_ROTOR = 0.04
"""kg·m², with an effect behind a soft transmission only."""
SOFT_DAMPING = 120.0
"""Most velocity gain per motor inertia, 1/s, with which drives behind a soft transmission do not
hunt."""
CHATTER_NM = 1.0
"""Torque of the velocity loop for one count."""
COARSE = 2.0**15
"""Counts per turn below which a drive counts on its motor's side, finer than the angle that it
reports."""
STRIBECK_FREE = 1e-3
"""Least friction level, N·m, so that bristles always have one."""


@dataclass(frozen=True)
class PlanarMachine:
    """A powered leg with drives in cascade. Arrays are hip, knee; SI units."""

    leg: Leg
    coulomb: NDArray
    viscous: NDArray
    presliding: NDArray
    """Angle by which bristles bend before the joint slides, rad."""
    bristle_damping: NDArray
    hip_rotor: float
    position_gain: NDArray
    """1/s."""
    velocity_gain: NDArray
    """N·m·s/rad."""
    integral_time: NDArray
    feedforward: float
    """Share of the set-point's velocity that is fed forward."""
    velocity_cutoff_hz: float
    drive_rate_hz: float
    current_lag_s: float
    limit: NDArray
    counts: NDArray
    drive_counts: NDArray
    ripple: NDArray
    """RMS of the error of the measured torque, N·m."""
    ripple_time: NDArray
    ripple_white: NDArray
    """Of the ripple's power, what is white."""
    ripple_lines: NDArray
    """(2, 3) shares of its power that depend on multiples of the motor's angle."""
    ripple_cycles: NDArray
    """(2, 3) cycles per turn of these; more than the catalogue's cogging has."""
    ripple_phase: NDArray
    walk: NDArray
    """RMS of a slow walk of the torque's zero, N·m."""
    torque_constant: NDArray
    """Relative error of the torque constants."""
    cuff_distance: tuple[float, float]
    cuff_zero: NDArray
    cuff_noise: float
    carried: float
    preload: float

    @property
    def rotors(self) -> NDArray:
        """Reflected inertia of the motors, (2,) kg·m²."""
        return np.array([self.hip_rotor, KNEE_ROTOR])

    def tuned_for_soft(self, joint: int) -> "PlanarMachine":
        """Return the machine with the drive of a joint tuned as a lab would tune it behind a soft
        transmission."""
        gain = self.velocity_gain.copy()
        gain[joint] = min(gain[joint], SOFT_DAMPING * self.rotors[joint])
        return replace(self, velocity_gain=gain)

    def controller(self, joint: int) -> dict:
        """Return what a recording says of a drive."""
        kd = float(self.velocity_gain[joint])
        stiffness = kd * float(self.position_gain[joint] + 1.0 / self.integral_time[joint])
        return {
            "type": "cascade",
            "kp_nm_rad": stiffness,
            "kd_nm_s_rad": kd,
            "rate_hz": self.drive_rate_hz,
            "limit_nm": float(self.limit[joint]),
        }


def random_machine(rng: Generator, thigh_length: float) -> PlanarMachine:
    """Draw an exoskeleton for a thigh of this length."""
    thigh, shank = rng.uniform(2.0, 6.0), rng.uniform(1.5, 3.5)
    leg = Leg(
        Segment(thigh, rng.uniform(0.3, 0.65) * thigh_length, thigh * rng.uniform(0.008, 0.025)),
        Segment(shank, rng.uniform(0.15, 0.27), shank * rng.uniform(0.01, 0.025)),
        thigh_length,
        float(rng.choice([9.8, 9.806, 9.81])),
    )
    rate, cutoff = float(rng.choice(DRIVE_RATES_HZ)), rng.uniform(30.0, 80.0)
    lag = rng.uniform(0.3e-3, 1e-3)
    counts = np.round(2.0 ** rng.uniform(12.0, 20.0, 2))
    drive_counts = np.where(counts < COARSE, counts * 2.0 ** rng.integers(4, 7, 2), counts)
    fine = CHATTER_NM / (2 * np.pi / drive_counts * 2 * np.pi * cutoff)
    late = 1.5 / rate + lag + 1.0 / (2 * np.pi * cutoff)
    quick = 0.45 * _inertias(leg) / late
    velocity_gain = np.minimum(np.minimum(rng.uniform([25.0, 10.0], [80.0, 30.0]), fine), quick)
    lines = np.where(rng.random((2, 3)) < 0.35, rng.uniform(0.01, 0.1, (2, 3)), 0.0)
    ripple = np.exp(rng.uniform(np.log(0.1), np.log(1.5), 2))
    coulomb = rng.uniform([0.8, 0.6], [5.0, 4.5])
    presliding = np.exp(rng.uniform(np.log(3e-4), np.log(2e-3), 2))
    return PlanarMachine(
        leg=leg,
        coulomb=coulomb,
        viscous=rng.uniform([1.0, 1.0], [6.0, 7.0]),
        presliding=presliding,
        bristle_damping=rng.uniform(0.2, 0.8, 2) * np.sqrt(0.1 * coulomb / presliding),
        hip_rotor=rng.uniform(0.03, 0.5),
        position_gain=rng.uniform(8.0, 20.0, 2),
        velocity_gain=velocity_gain,
        integral_time=rng.uniform(0.08, 0.4, 2),
        feedforward=float(rng.choice([0.0, 0.5, 0.8, 1.0])),
        velocity_cutoff_hz=cutoff,
        drive_rate_hz=rate,
        current_lag_s=lag,
        limit=rng.uniform([120.0, 80.0], [250.0, 180.0]),
        counts=counts,
        drive_counts=drive_counts,
        ripple=ripple,
        ripple_time=np.exp(rng.uniform(np.log(0.002), np.log(0.2), 2)),
        ripple_white=rng.uniform(0.0, 0.4, 2),
        ripple_lines=lines,
        ripple_cycles=rng.integers(500, 2000, (2, 3)).astype(float),
        ripple_phase=rng.uniform(0.0, 2 * np.pi, (2, 3)),
        walk=np.minimum(rng.uniform(0.0, 0.1, 2) * ripple, 0.04),
        torque_constant=rng.normal(0.0, 0.0005, 2),
        cuff_distance=(rng.uniform(0.45, 0.75) * thigh_length, rng.uniform(0.15, 0.28)),
        cuff_zero=rng.normal(0.0, 2.0, (4, 3)),
        cuff_noise=rng.uniform(0.1, 1.2),
        carried=rng.uniform(0.0, 0.3),
        preload=rng.uniform(5.0, 30.0),
    )


def _inertias(leg: Leg) -> NDArray:
    """Return the least inertia that each motor feels while the other joint is free, (2,) kg·m²."""
    c, M, bias = two_link.coefficients(leg), np.empty((2, 2)), np.empty(2)
    inertias = []
    for knee in np.linspace(-1.6, -0.2, 8):
        two_link.mass_and_bias(c, 0.0, 0.0, 0.0, knee, 0.0, 0.0, M, bias)
        inertias.append(np.linalg.det(M) / np.array([M[1, 1], M[0, 0]]))
    return np.min(inertias, axis=0)


class Drives(NamedTuple):
    """Cascaded loops and encoders; arrays (2,), ``wobble`` (2, 6)."""

    position: np.ndarray
    velocity: np.ndarray
    integral: np.ndarray
    feedforward: float
    limit: np.ndarray
    count: np.ndarray
    recorded_count: np.ndarray
    offset: np.ndarray
    wobble: np.ndarray
    speed_share: float
    current_share: float
    steps: int
    """Integration steps between two ticks of the drives."""


class Joints(NamedTuple):
    """Friction and transmissions; arrays (2,), ``spring`` (2, 5), ``added_mass`` (2, 2)."""

    coulomb: np.ndarray
    viscous: np.ndarray
    bristle: np.ndarray
    bristle_damping: np.ndarray
    added_mass: np.ndarray
    transmission: np.ndarray
    motor_inertia: np.ndarray
    spring: np.ndarray
    cuffs: np.ndarray
    levers: np.ndarray


class Log(NamedTuple):
    """What happened, at the samples (n, 2), and torque and angle of the motors at each
    millisecond."""

    reading: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    link_acceleration: np.ndarray
    wound: np.ndarray
    link: np.ndarray
    cuff: np.ndarray
    human: np.ndarray
    reference: np.ndarray
    drive_speed: np.ndarray
    torque: np.ndarray
    motor: np.ndarray


@njit()
def simulate(x, d, jt, w, hid, start, samples, sample_steps, with_drives, out):
    """Run the leg from rest at ``start`` (2,) and log ``samples`` samples from time 0 on into
    ``out``."""
    q, v, a = np.zeros(2), np.zeros(2), np.zeros(2)
    th, om, motor_a = np.zeros(2), np.zeros(2), np.zeros(2)
    hq, hv, ha = np.zeros(2), np.zeros(2), np.zeros(2)
    bristle, friction, up, down = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    load, human, passed, dry = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    creep = np.zeros(2)
    ref, old_ref, pressed = np.zeros(2), np.zeros(2), np.zeros(2)
    seen, speed, integral, wanted, drive = (
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
    )
    M, bias, force = np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    hM, hbias, hforce = np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    c = w.driven.copy()
    for j in range(2):
        q[j] = th[j] = hq[j] = start[j]
        seen[j] = reading(d.offset[j], d.wobble[j], start[j])
    first = -round(LEAD_IN_S / DT) if with_drives else 0
    reference_at(x, first * DT, old_ref)
    tick = d.steps * DT
    for s in range(first, samples * sample_steps):
        t = s * DT
        tilt = w.tilt[0] + w.tilt[1] * sin(6.283185307179586 * w.tilt[2] * t)
        if w.payload[0] >= 0:
            share = min(1.0, max(0.0, (t - w.payload[3]) / w.payload[4]))
            lump = w.payload[2] * (share if w.payload[5] > 0 else 1.0 - share)
            two_link.add_lump(w.driven, int(w.payload[0]), lump, w.payload[1], w.length, c)
        if with_drives and s % d.steps == 0:
            reference_at(x, t, ref)
            for j in range(2):
                now = reading(d.offset[j], d.wobble[j], th[j])
                if d.count[j] > 0.0:
                    now = d.count[j] * np.floor(now / d.count[j])
                speed[j] += d.speed_share * ((now - seen[j]) / tick - speed[j])
                seen[j] = now
                goal = d.position[j] * (ref[j] - now) + d.feedforward * (ref[j] - old_ref[j]) / tick
                error = goal - speed[j]
                whole = d.velocity[j] * error + integral[j]
                wanted[j] = min(d.limit[j], max(-d.limit[j], whole))
                if wanted[j] == whole:
                    integral[j] += d.integral[j] * error * tick
                old_ref[j] = ref[j]
        two_link.mass_and_bias(c, w.gravity, tilt, q[0], q[1], v[0], v[1], M, bias)
        for j in range(2):
            drive[j] += d.current_share * (wanted[j] - drive[j])
            for i in range(2):
                M[j, i] += jt.added_mass[j, i]
            force[j] = -bias[j]
            up[j] = down[j] = jt.coulomb[j]
            friction[j] = human[j] = passed[j] = 0.0
            if jt.transmission[j] == RIGID:
                th[j], om[j] = q[j], v[j]
            else:
                passed[j] = transmitted(
                    jt.transmission[j], jt.spring[j], th[j] - q[j], om[j] - v[j]
                )
        if w.own:
            two_link.mass_and_bias(w.wearer, w.gravity, tilt, hq[0], hq[1], hv[0], hv[1], hM, hbias)
            for j in range(2):
                hforce[j] = -hbias[j]
            press(jt.cuffs, jt.levers, q, v, hq, hv, creep, DT, force, hforce, pressed)
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
                if w.own:
                    hforce[j] -= extra
                else:
                    force[j] -= extra
            else:
                friction[j] += smooth_torque(
                    hid.kind[i], hid.p[i], hid.memory[i], hid.table[i], t, DT, j, th, om, a
                )
        for j in range(2):
            level = max(STRIBECK_FREE, up[j] if om[j] > 0.0 else down[j])
            stiff = jt.bristle[j]
            sign = 1.0 if om[j] > 0.0 else -1.0
            bend_rate = om[j] * (1.0 - stiff * bristle[j] * sign / level)
            dry[j] = stiff * bristle[j] + jt.bristle_damping[j] * bend_rate
            target = sign * level / stiff
            bristle[j] = target + (bristle[j] - target) * exp(-abs(om[j]) * DT * stiff / level)
            friction[j] += jt.viscous[j] * om[j]
            rest = drive[j] - friction[j] - dry[j]
            if jt.transmission[j] == RIGID:
                force[j] += rest
            else:
                force[j] += passed[j]
                motor_a[j] = (rest - passed[j]) / jt.motor_inertia[j]
        two_link.accelerations(M, force, a)
        for j in range(2):
            if jt.transmission[j] == RIGID:
                motor_a[j] = a[j]
                load[j] = drive[j] - friction[j] - dry[j]
            else:
                load[j] = passed[j]
        if w.own:
            two_link.accelerations(hM, hforce, ha)
        if s >= 0:
            k = (s + sample_steps // 2) // sample_steps
            if k < samples:
                for j in range(2):
                    out.link_acceleration[k, j] += a[j] / sample_steps
                    out.wound[k, j] += (th[j] - q[j]) / sample_steps
            if s % STEPS_PER_MS == 0:
                k = s // STEPS_PER_MS
                for j in range(2):
                    out.torque[k, j] = drive[j]
                    out.motor[k, j] = th[j]
            if s % sample_steps == 0:
                k = s // sample_steps
                for j in range(2):
                    _latch(out, k, j, d, th[j], om[j], motor_a[j])
                    out.link[k, j], out.link[k, 2 + j], out.link[k, 4 + j] = q[j], v[j], a[j]
                    out.cuff[k, j] = pressed[j]
                    out.human[k, j] = human[j]
                    out.reference[k, j] = ref[j]
                    out.drive_speed[k, j] = speed[j]
        for j in range(2):
            v[j] += DT * a[j]
            q[j] += DT * v[j]
            if jt.transmission[j] == RIGID:
                th[j], om[j] = q[j], v[j]
            else:
                om[j] += DT * motor_a[j]
                th[j] += DT * om[j]
            if w.own:
                hv[j] += DT * ha[j]
                hq[j] += DT * hv[j]


@njit()
def _latch(out, k, j, d, theta, omega, acceleration):
    """Log a motor's angle as its encoder reads it, and what speed and acceleration that is."""
    angle = reading(d.offset[j], d.wobble[j], theta)
    count = d.recorded_count[j]
    out.angle[k, j] = angle
    out.reading[k, j] = count * np.round(angle / count) if count > 0.0 else angle
    factor = slope(d.wobble[j], theta)
    out.speed[k, j] = omega * factor
    bend = curvature(d.wobble[j], theta)
    out.acceleration[k, j] = acceleration * factor + bend * omega * omega


def record(
    rig: Rig, motion: Trajectory, plan: Plan, run: Run, noise: Generator, conditions: Conditions
) -> Recorded:
    """Simulate and measure one run."""
    n = round(run.duration_s / conditions.sample_s)
    log = move(rig, motion, plan, run, n, conditions)
    t = np.arange(n) * conditions.sample_s
    clean = through(plan.channel, log.torque, 1e-3, log.motor)[:: conditions.ticks]
    reported = Reported(log.angle, log.speed, log.acceleration, log.link_acceleration, log.wound)
    soft = plan.transmission != RIGID
    effect = clean - needed(rig, run, reported, soft, conditions.sample_s)
    forces = None
    if run.has_human and conditions.has_cuffs:
        across = None if plan.cuffs is None else log.cuff
        forces = cuff_forces(rig, plan, log.link, log.human, across, t, noise)
    return Recorded(
        run=run,
        time=t,
        angle=log.reading,
        torque=clean
        + _error(rig.machine, clean, log.motor[:: conditions.ticks], noise, conditions),
        reference=log.reference,
        drive_speed=log.drive_speed,
        forces=forces,
        clean_torque=clean,
        effect=effect,
        true_speed=log.speed,
        link=log.link,
        sample_s=conditions.sample_s,
    )


def move(
    rig: Rig, motion: Trajectory, plan: Plan, run: Run, samples: int, conditions: Conditions
) -> Log:
    """Run the compiled loop."""
    m = rig.machine
    sample_steps = STEPS_PER_MS * conditions.ticks
    tick = round(1.0 / (DT * m.drive_rate_hz))
    drives = Drives(
        m.position_gain,
        m.velocity_gain,
        m.velocity_gain / m.integral_time,
        m.feedforward,
        m.limit,
        2 * np.pi / m.drive_counts,
        2 * np.pi / m.counts,
        plan.encoder_offset,
        plan.wobble,
        float(1.0 - np.exp(-2 * np.pi * m.velocity_cutoff_hz / m.drive_rate_hz)),
        float(1.0 - np.exp(-DT / m.current_lag_s)),
        tick,
    )
    log = empty_log(samples, conditions.ticks)
    none = np.zeros((2, 1))
    excited = Excited(motion.middle, none, none, 1.0, motion.table(samples * conditions.sample_s))
    simulate(
        excited,
        drives,
        _joints(rig, plan),
        links_of(rig, plan, run),
        plan.hidden(),
        motion.middle,
        samples,
        sample_steps,
        True,
        log,
    )
    check(log.angle, log.torque)
    return log


def empty_log(samples: int, ticks: int) -> Log:
    """Return arrays for the loop to write into."""
    pairs = {
        name: np.zeros((samples, 2))
        for name in Log._fields
        if name not in ("link", "torque", "motor")
    }
    milliseconds = {name: np.zeros((samples * ticks, 2)) for name in ("torque", "motor")}
    return Log(**pairs, **milliseconds, link=np.zeros((samples, 6)))


def _joints(rig: Rig, plan: Plan) -> Joints:
    m = rig.machine
    # The hip's rotor turns with the thigh unless something soft is between them.
    mass = plan.added_mass + np.diag([m.hip_rotor if plan.transmission[HIP] == RIGID else 0.0, 0.0])
    levers = np.array([*m.cuff_distance, m.leg.length])
    cuffs = np.zeros((2, 6)) if plan.cuffs is None else per_metre(plan.cuffs, levers)
    return Joints(
        m.coulomb,
        m.viscous,
        m.coulomb / m.presliding,
        m.bristle_damping,
        mass,
        plan.transmission,
        m.rotors,
        plan.spring,
        cuffs,
        levers,
    )


def _error(
    m: PlanarMachine, clean: NDArray, angle: NDArray, noise: Generator, conditions: Conditions
) -> NDArray:
    """Return the error of the measured torque: its constant, white and coloured noise, lines, and a
    slow walk."""
    n = len(clean)
    out = m.torque_constant * clean
    for j in range(2):
        memory = np.exp(-conditions.sample_s / m.ripple_time[j])
        driven = noise.standard_normal(n) * np.sqrt(1.0 - memory**2)
        coloured, _ = lfilter([1.0], [1.0, -memory], driven, zi=[memory * noise.standard_normal()])
        lines = m.ripple_lines[j].sum()
        out[:, j] += (
            m.ripple[j] * np.sqrt((1.0 - lines) * m.ripple_white[j]) * noise.standard_normal(n)
        )
        out[:, j] += m.ripple[j] * np.sqrt((1.0 - lines) * (1.0 - m.ripple_white[j])) * coloured
        for share, cycles, phase in zip(
            m.ripple_lines[j], m.ripple_cycles[j], m.ripple_phase[j], strict=True
        ):
            out[:, j] += m.ripple[j] * np.sqrt(2.0 * share) * np.sin(cycles * angle[:, j] + phase)
        walk = np.cumsum(noise.standard_normal(n))
        walk -= walk.mean()
        out[:, j] += m.walk[j] * walk / np.sqrt(np.mean(walk**2))
    return out
