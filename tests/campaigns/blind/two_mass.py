"""World *two_mass*: motors and links are masses of their own, joined by stiff springs at both
joints.

Friction acts on the motors: regularised Coulomb friction whose level rises a little with the load
over a preload, and a gear that loses a share of what it transmits. Cuffs are always firm but
finite, so the wearer's leg is one of its own. Drives follow a model of the leg (computed torque, or
position control with gravity) that is a little wrong. The measured torque is a mean over the
sample.
"""

from dataclasses import dataclass, replace
from math import sin, sqrt, tanh
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
from tests.campaigns.blind.plan import Plan, Run
from tests.campaigns.blind.recorded import Recorded, Rig
from tests.campaigns.blind.smooth import smooth_torque
from tests.campaigns.blind.trajectories import Trajectory
from tests.campaigns.blind.transmissions import ELASTIC, RIGID, per_metre, press, transmitted

DT = 0.2e-3
STEPS_PER_MS = 5
DRIVE_RATES_HZ = (1000.0, 5000.0 / 3.0, 2500.0)
SOFT_ROTOR = 0.04
"""kg·m² of a knee's motor that a soft transmission sets free, as in the other worlds."""
SOFT_DAMPING = 100.0
"""Most damping per motor inertia behind a soft transmission, 1/s."""
OCTAVES_S = (0.003, 0.012, 0.05, 0.2)
"""Correlation times whose sum is nearly pink noise."""


@dataclass(frozen=True)
class TwoMassMachine:
    """A powered leg with flexible gears. Arrays are hip, knee; SI units."""

    leg: Leg
    coulomb: NDArray
    viscous: NDArray
    creep_speed: NDArray
    """Speed over which Coulomb friction changes its sign, rad/s."""
    load_preload: NDArray
    """Load at which friction would have risen by 41 %, N·m."""
    gear_loss: NDArray
    """Share of the transmitted torque that is lost."""
    hip_rotor: float
    knee_rotor: float
    stiffness: NDArray
    """Of the gears, N·m/rad."""
    gear_damping: NDArray
    computed_torque: bool
    frequency: NDArray
    """Of the drives' position loops, rad/s."""
    damping_ratio: NDArray
    model_error: NDArray
    """(8,) relative errors of the drive's model of the leg."""
    drive_rate_hz: float
    speed_cutoff_hz: float
    limit: NDArray
    counts: NDArray
    drive_counts: NDArray
    ripple: NDArray
    ripple_time: NDArray
    pink: NDArray
    """(2, 4) shares of the ripple's power at the correlation times of ``OCTAVES_S``."""
    resonance: NDArray
    """(2, 3): share of its power, frequency (Hz) and damping ratio of something that rings."""
    proportional: NDArray
    """Ripple in proportion to the torque, rms."""
    cuff_stiffness: NDArray
    cuff_damping: NDArray
    cuff_distance: tuple[float, float]
    cuff_zero: NDArray
    cuff_noise: float
    carried: float
    preload: float
    softened: NDArray
    """Whether a drive is tuned for a soft transmission, (2,) bool."""

    @property
    def rotors(self) -> NDArray:
        """Reflected inertia of the motors, (2,) kg·m²."""
        knee = SOFT_ROTOR if self.softened[1] else self.knee_rotor
        return np.array([self.hip_rotor, knee])

    @property
    def ripple_cycles(self) -> NDArray:
        """No part of this world's ripple depends on angles."""
        return np.zeros(2)

    def tuned_for_soft(self, joint: int) -> "TwoMassMachine":
        """Return the machine with a drive tuned as a lab would behind a soft transmission."""
        softened = self.softened.copy()
        softened[joint] = True
        return replace(self, softened=softened)

    def gains(self, leg: Leg) -> tuple[NDArray, NDArray]:
        """Return stiffness and damping (2,) of position control of a leg."""
        inertias = np.diag(_mass(two_link.coefficients(leg), -0.9)) + self.rotors
        kp = np.clip(inertias * self.frequency**2, [250.0, 120.0], [1600.0, 800.0])
        kd = 2.0 * self.damping_ratio * np.sqrt(kp * inertias)
        most = np.where(self.softened, SOFT_DAMPING, 2500.0) * self.rotors
        return kp, np.minimum(kd, most)

    def controller(self, joint: int) -> dict:
        """Return what a recording says of a drive."""
        kp, kd = self.gains(self.leg)
        return {
            "type": "computed_torque" if self.computed_torque else "pd_gravity",
            "kp_nm_rad": float(kp[joint]),
            "kd_nm_s_rad": float(kd[joint]),
            "rate_hz": self.drive_rate_hz,
            "limit_nm": float(self.limit[joint]),
        }


def random_machine(rng: Generator, thigh_length: float) -> TwoMassMachine:
    """Draw an exoskeleton for a thigh of this length."""
    thigh, shank = rng.uniform(2.5, 7.0), rng.uniform(1.5, 3.5)
    leg = Leg(
        Segment(thigh, rng.uniform(0.25, 0.6) * thigh_length, thigh * rng.uniform(0.008, 0.02)),
        Segment(shank, rng.uniform(0.14, 0.28), shank * rng.uniform(0.01, 0.025)),
        thigh_length,
        9.81,
    )
    stiffness = np.exp(rng.uniform(np.log([1.2e4, 4e3]), np.log([2.5e4, 2e4])))
    hip_rotor, knee_rotor = rng.uniform(0.05, 0.4), rng.uniform(0.004, 0.008)
    counts = np.round(2.0 ** rng.uniform(12.0, 20.0, 2))
    pink = rng.dirichlet(np.full(len(OCTAVES_S), 1.5), 2)
    rings = np.where(rng.random(2) < 0.5, rng.uniform(0.05, 0.3, 2), 0.0)
    cuffs = np.exp(rng.uniform(np.log(2e4), np.log(6e4), 2))
    return TwoMassMachine(
        leg=leg,
        coulomb=rng.uniform([0.7, 0.5], [4.5, 4.0]),
        viscous=rng.uniform([1.5, 1.5], [7.0, 6.0]),
        creep_speed=np.exp(rng.uniform(np.log(0.002), np.log(0.012), 2)),
        load_preload=rng.uniform(150.0, 500.0, 2),
        gear_loss=np.exp(rng.uniform(np.log(0.0003), np.log(0.002), 2)),
        hip_rotor=hip_rotor,
        knee_rotor=knee_rotor,
        stiffness=stiffness,
        gear_damping=rng.uniform(0.05, 0.2, 2) * np.sqrt(stiffness * np.array([0.05, 0.01])),
        computed_torque=bool(rng.random() < 0.5),
        frequency=rng.uniform(9.0, 22.0, 2),
        damping_ratio=rng.uniform(0.5, 1.0, 2),
        model_error=rng.uniform(-0.12, 0.08, 8),
        drive_rate_hz=float(rng.choice(DRIVE_RATES_HZ)),
        speed_cutoff_hz=rng.uniform(30.0, 80.0),
        limit=rng.uniform([120.0, 80.0], [250.0, 180.0]),
        counts=counts,
        drive_counts=np.maximum(counts, np.round(2.0 ** rng.uniform(18.0, 21.0, 2))),
        ripple=np.exp(rng.uniform(np.log(0.1), np.log(1.5), 2)),
        ripple_time=pink @ np.array(OCTAVES_S),
        pink=pink,
        resonance=np.column_stack([rings, rng.uniform(12.0, 45.0, 2), rng.uniform(0.01, 0.1, 2)]),
        proportional=rng.uniform(0.0, 0.004, 2),
        cuff_stiffness=cuffs,
        cuff_damping=cuffs * rng.uniform(0.002, 0.006, 2),
        cuff_distance=(rng.uniform(0.5, 0.75) * thigh_length, rng.uniform(0.16, 0.28)),
        cuff_zero=rng.normal(0.0, 1.0, (4, 3)),
        cuff_noise=rng.uniform(0.15, 1.0),
        carried=0.0,
        preload=rng.uniform(5.0, 30.0),
        softened=np.zeros(2, dtype=bool),
    )


def _mass(c: NDArray, knee: float) -> NDArray:
    M, bias = np.empty((2, 2)), np.empty(2)
    two_link.mass_and_bias(c, 0.0, 0.0, 0.0, knee, 0.0, 0.0, M, bias)
    return M


class Drives(NamedTuple):
    """Model-based position control and encoders; arrays (2,), ``wobble`` (2, 6)."""

    model: np.ndarray
    """(8,) coefficients of the leg as the drives believe it."""
    gravity: float
    computed_torque: bool
    kp: np.ndarray
    kd: np.ndarray
    friction: np.ndarray
    """Viscous friction that the drives make up for."""
    limit: np.ndarray
    count: np.ndarray
    recorded_count: np.ndarray
    offset: np.ndarray
    wobble: np.ndarray
    speed_share: float
    steps: int


class Joints(NamedTuple):
    """Motors, gears and cuffs; arrays (2,), ``spring`` (2, 5)."""

    coulomb: np.ndarray
    viscous: np.ndarray
    creep_speed: np.ndarray
    preload: np.ndarray
    gear_loss: np.ndarray
    inertia: np.ndarray
    added_mass: np.ndarray
    transmission: np.ndarray
    spring: np.ndarray
    cuffs: np.ndarray
    levers: np.ndarray


class Log(NamedTuple):
    """What happened in the middle of each sample (n, 2), and each millisecond's mean torque."""

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
def _command(d, ref, old_ref, older_ref, seen, speed, tick, M, bias, wanted):
    """Write the torques (2,) that the drives ask for."""
    pull = np.zeros(2)
    still = 0.0 if not d.computed_torque else 1.0
    two_link.mass_and_bias(
        d.model, d.gravity, 0.0, seen[0], seen[1], still * speed[0], still * speed[1], M, bias
    )
    for j in range(2):
        rate = (ref[j] - old_ref[j]) / tick
        error = d.kp[j] * (ref[j] - seen[j]) + d.kd[j] * (rate - speed[j])
        # Here kp and kd are torques; a computed torque wants accelerations of the diagonal's
        # inertia.
        pull[j] = error / M[j, j] if d.computed_torque else error
        if d.computed_torque:
            pull[j] += (ref[j] - 2.0 * old_ref[j] + older_ref[j]) / (tick * tick)
    for j in range(2):
        wanted[j] = bias[j]
        if d.computed_torque:
            wanted[j] += M[j, 0] * pull[0] + M[j, 1] * pull[1] + d.friction[j] * speed[j]
        else:
            wanted[j] += pull[j]
        wanted[j] = min(d.limit[j], max(-d.limit[j], wanted[j]))


@njit()
def simulate(x, d, jt, w, hid, start, samples, sample_steps, with_drives, out):
    """Run both masses of both joints from rest and log ``samples`` samples from time 0 on."""
    q, v, a = start.copy(), np.zeros(2), np.zeros(2)
    th, om, motor_a = start.copy(), np.zeros(2), np.zeros(2)
    hq, hv, ha = start.copy(), np.zeros(2), np.zeros(2)
    up, down, smooth = np.zeros(2), np.zeros(2), np.zeros(2)
    load, human, creep, pressed = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    ref, old_ref, older_ref = np.zeros(2), np.zeros(2), np.zeros(2)
    seen, speed, drive = np.zeros(2), np.zeros(2), np.zeros(2)
    M, bias, force = np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    hM, hbias, hforce = np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    c = w.driven.copy()
    for j in range(2):
        seen[j] = reading(d.offset[j], d.wobble[j], start[j])
    first = -round(LEAD_IN_S / DT) if with_drives else 0
    reference_at(x, first * DT, old_ref)
    older_ref[:] = old_ref
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
                    now = d.count[j] * np.round(now / d.count[j])
                # An observer that follows the counts: its speed is what it had to be moved by.
                speed[j] += d.speed_share * ((now - seen[j]) / tick - speed[j])
                seen[j] = now
            _command(d, ref, old_ref, older_ref, seen, speed, tick, M, bias, drive)
            older_ref[:] = old_ref
            old_ref[:] = ref
        two_link.mass_and_bias(c, w.gravity, tilt, q[0], q[1], v[0], v[1], M, bias)
        for j in range(2):
            for i in range(2):
                M[j, i] += jt.added_mass[j, i]
            wound, rate = th[j] - q[j], om[j] - v[j]
            load[j] = transmitted(jt.transmission[j], jt.spring[j], wound, rate)
            force[j] = load[j] - bias[j]
            level = jt.coulomb[j] * sqrt(1.0 + (load[j] / jt.preload[j]) ** 2)
            up[j] = down[j] = level + jt.gear_loss[j] * abs(load[j])
            smooth[j] = human[j] = 0.0
        if w.own:
            two_link.mass_and_bias(w.wearer, w.gravity, tilt, hq[0], hq[1], hv[0], hv[1], hM, hbias)
            for j in range(2):
                hforce[j] = -hbias[j]
            press(jt.cuffs, jt.levers, q, v, hq, hv, creep, DT, force, hforce, pressed)
        for i in range(len(hid.kind)):
            j, kind = hid.joint[i], hid.kind[i]
            if is_dry(kind):
                more, less = dry_levels(
                    kind, hid.p[i], hid.table[i], t, j, th[j], q[1 - j], om, load
                )
                up[j] += more
                down[j] += less
            elif hid.human[i]:
                extra = smooth_torque(
                    kind, hid.p[i], hid.memory[i], hid.table[i], t, DT, j, hq, hv, ha
                )
                human[j] += extra
                hforce[j] -= extra
            else:
                smooth[j] += smooth_torque(
                    kind, hid.p[i], hid.memory[i], hid.table[i], t, DT, j, th, om, a
                )
        two_link.accelerations(M, force, a)
        if w.own:
            two_link.accelerations(hM, hforce, ha)
        for j in range(2):
            level = max(0.0, up[j] if om[j] > 0.0 else down[j])
            slide = tanh(om[j] / jt.creep_speed[j])
            steep = level * (1.0 - slide * slide) / jt.creep_speed[j] + jt.viscous[j]
            rest = drive[j] - load[j] - smooth[j] - jt.viscous[j] * om[j] - level * slide
            # Friction is as steep as a wall near rest: linearised and implicit.
            motor_a[j] = rest / (jt.inertia[j] + DT * steep)
        if s >= 0:
            k = s // STEPS_PER_MS
            for j in range(2):
                out.torque[k, j] += drive[j] / STEPS_PER_MS
                if s % STEPS_PER_MS == STEPS_PER_MS // 2:
                    out.motor[k, j] = th[j]
            k = s // sample_steps
            for j in range(2):
                out.link_acceleration[k, j] += a[j] / sample_steps
                out.wound[k, j] += (th[j] - q[j]) / sample_steps
                measured = motor_a[j] * slope(d.wobble[j], th[j])
                measured += curvature(d.wobble[j], th[j]) * om[j] * om[j]
                out.acceleration[k, j] += measured / sample_steps
            if s % sample_steps == sample_steps // 2:
                k = s // sample_steps
                for j in range(2):
                    _latch(out, k, j, d, th[j], om[j])
                    out.link[k, j], out.link[k, 2 + j], out.link[k, 4 + j] = q[j], v[j], a[j]
                    out.cuff[k, j] = pressed[j]
                    out.human[k, j] = human[j]
                    out.reference[k, j] = ref[j]
                    out.drive_speed[k, j] = speed[j]
        for j in range(2):
            v[j] += DT * a[j]
            q[j] += DT * v[j]
            om[j] += DT * motor_a[j]
            th[j] += DT * om[j]
            if w.own:
                hv[j] += DT * ha[j]
                hq[j] += DT * hv[j]


@njit()
def _latch(out, k, j, d, theta, omega):
    """Log a motor's angle and speed as its encoder reads them."""
    angle = reading(d.offset[j], d.wobble[j], theta)
    count = d.recorded_count[j]
    out.angle[k, j] = angle
    out.reading[k, j] = count * np.round(angle / count) if count > 0.0 else angle
    out.speed[k, j] = omega * slope(d.wobble[j], theta)


def record(
    rig: Rig, motion: Trajectory, plan: Plan, run: Run, noise: Generator, conditions: Conditions
) -> Recorded:
    """Simulate and measure one run."""
    n = round(run.duration_s / conditions.sample_s)
    m = rig.machine
    if run.has_human and plan.cuffs is None:
        plan.cuffs = np.zeros((2, 6))
        plan.cuffs[:, 0], plan.cuffs[:, 1] = m.cuff_stiffness, m.cuff_damping
    log = move(rig, motion, plan, run, n, conditions)
    t = (np.arange(n) + 0.5) * conditions.sample_s
    channel = through(plan.channel, log.torque, 1e-3, log.motor)
    clean = channel.reshape(-1, conditions.ticks, 2).mean(axis=1)
    reported = Reported(log.angle, log.speed, log.acceleration, log.link_acceleration, log.wound)
    trembling = np.ones(2, dtype=bool)
    effect = clean - needed(rig, run, reported, trembling, conditions.sample_s)
    forces = None
    if run.has_human and conditions.has_cuffs:
        forces = cuff_forces(rig, plan, log.link, log.human, log.cuff, t, noise)
    return Recorded(
        run=run,
        time=t,
        angle=log.reading,
        torque=clean + _error(m, clean, noise, conditions),
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
    log = empty_log(samples, conditions.ticks)
    none = np.zeros((2, 1))
    table = motion.table(samples * conditions.sample_s)
    excited = Excited(motion.middle, none, none, 1.0, table)
    links = links_of(rig, plan, run)
    steps = STEPS_PER_MS * conditions.ticks
    drives, joints = _drives(rig, plan, run), _joints(rig, plan)
    simulate(
        excited, drives, joints, links, plan.hidden(), motion.middle, samples, steps, True, log
    )
    check(log.angle, log.torque)
    return log


def empty_log(samples: int, ticks: int) -> Log:
    """Return arrays for the loop to write into."""
    others = ("link", "torque", "motor")
    pairs = {name: np.zeros((samples, 2)) for name in Log._fields if name not in others}
    milliseconds = {name: np.zeros((samples * ticks, 2)) for name in ("torque", "motor")}
    return Log(**pairs, **milliseconds, link=np.zeros((samples, 6)))


def _drives(rig: Rig, plan: Plan, run: Run) -> Drives:
    m = rig.machine
    leg = rig.leg(run)
    kp, kd = m.gains(leg)
    return Drives(
        two_link.coefficients(leg) * (1.0 + m.model_error),
        leg.gravity,
        m.computed_torque,
        kp,
        kd,
        0.8 * m.viscous,
        m.limit,
        2 * np.pi / m.drive_counts,
        2 * np.pi / m.counts,
        plan.encoder_offset,
        plan.wobble,
        float(1.0 - np.exp(-2 * np.pi * m.speed_cutoff_hz / m.drive_rate_hz)),
        round(1.0 / (DT * m.drive_rate_hz)),
    )


def _joints(rig: Rig, plan: Plan) -> Joints:
    m = rig.machine
    kinds, springs = plan.transmission.copy(), plan.spring.copy()
    for j in range(2):
        if kinds[j] == RIGID:
            kinds[j] = ELASTIC
            springs[j] = m.stiffness[j], m.gear_damping[j], 0.0, 0.0, 0.0
    # What is added to one joint alone turns with its motor; what couples both, with the links.
    alone = not (plan.added_mass - np.diag(np.diag(plan.added_mass))).any()
    inertia = m.rotors + (np.diag(plan.added_mass) if alone else 0.0)
    levers = np.array([*m.cuff_distance, m.leg.length])
    return Joints(
        m.coulomb,
        m.viscous,
        m.creep_speed,
        m.load_preload,
        m.gear_loss,
        inertia,
        np.zeros((2, 2)) if alone else plan.added_mass,
        kinds,
        springs,
        np.zeros((2, 6)) if plan.cuffs is None else per_metre(plan.cuffs, levers),
        levers,
    )


def _error(m: TwoMassMachine, clean: NDArray, noise: Generator, conditions: Conditions) -> NDArray:
    """Return the error of the measured torque: nearly pink, something that rings, and a share."""
    n = len(clean)
    out = np.empty_like(clean)
    for j in range(2):
        pink = np.zeros(n)
        for share, time in zip(m.pink[j], OCTAVES_S, strict=True):
            memory = np.exp(-conditions.sample_s / time)
            driven = noise.standard_normal(n) * np.sqrt(1.0 - memory**2)
            start = [memory * noise.standard_normal()]
            pink += np.sqrt(share) * lfilter([1.0], [1.0, -memory], driven, zi=start)[0]
        share, frequency, damping = m.resonance[j]
        ringing = _ringing(noise.standard_normal(n), frequency, damping, conditions.rate_hz)
        out[:, j] = m.ripple[j] * (np.sqrt(1.0 - share) * pink + np.sqrt(share) * ringing)
        out[:, j] += m.proportional[j] * clean[:, j] * noise.standard_normal(n)
    return out


def _ringing(driven: NDArray, frequency: float, damping: float, rate_hz: float) -> NDArray:
    """Return white noise through a resonance, with unit rms."""
    turn = 2 * np.pi * min(frequency, 0.45 * rate_hz) / rate_hz
    radius = np.exp(-damping * turn)
    ringing = lfilter([1.0], [1.0, -2.0 * radius * np.cos(turn), radius**2], driven)
    return ringing / np.sqrt(np.mean(ringing**2))
