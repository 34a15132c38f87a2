"""One run on the simulated rig: build the leg with what is hidden in it, move it, and measure."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt

from tests.campaigns.blind import loop
from tests.campaigns.blind.body import Body
from tests.campaigns.blind.channel import through
from tests.campaigns.blind.conditions import PLAIN, Conditions
from tests.campaigns.blind.cuffs import firm_forces, pad_forces
from tests.campaigns.blind.excitation import PERIOD_S, Excitation
from tests.campaigns.blind.machine import DRIVE_RATE_HZ, SPEED_CUTOFF_HZ, Machine
from tests.campaigns.blind.plan import HIP, Plan, Run
from tests.campaigns.blind.recorded import Recorded, Rig
from tests.campaigns.blind.trajectories import Trajectory
from tests.campaigns.blind.transmissions import RIGID, per_metre

FOLLOWED_HZ = 12.0


def record(
    rig: Rig,
    motion: Excitation | Trajectory,
    plan: Plan,
    run: Run,
    noise: Generator,
    conditions: Conditions = PLAIN,
) -> Recorded:
    """Simulate and measure one run."""
    machine = rig.machine
    n = round(run.duration_s / conditions.sample_s)
    log = move(rig, motion, plan, run, n, conditions)
    t = (np.arange(n) + 0.5) * conditions.sample_s
    clean = _reported(log, t, plan, conditions)
    needed = _needed(rig, plan, run, log, conditions)
    forces = None
    if run.has_human and conditions.has_cuffs:
        forces = _cuff_forces(rig, plan, log, noise, conditions)
    return Recorded(
        run=run,
        time=t,
        angle=log.reading,
        torque=clean + _ripple(machine, log.angle, noise, conditions),
        reference=log.reference,
        drive_speed=log.drive_speed,
        forces=forces,
        clean_torque=clean,
        effect=clean - needed,
        true_speed=log.speed,
        link=log.link,
        weight=rig.weight,
        sample_s=conditions.sample_s,
    )


def _needed(rig: Rig, plan: Plan, run: Run, log: loop.Log, conditions: Conditions) -> NDArray:
    """Torque that the faultless machine needs for the reported motion, encoder's errors and all,
    (n, 2) N·m."""
    machine = rig.machine
    acceleration = log.acceleration.copy()
    soft = plan.transmission != RIGID
    # A motor behind something soft trembles alone; the leg follows only what is slower.
    followed = butter(2, FOLLOWED_HZ, fs=conditions.rate_hz, output="sos")
    acceleration[:, soft] = sosfiltfilt(followed, acceleration[:, soft], axis=0)
    needed = Body(rig.leg(run)).inverse(log.angle, log.speed, acceleration)
    needed[:, HIP] += machine.hip_rotor * acceleration[:, HIP] + rig.weight
    needed += machine.rotors * (log.acceleration - acceleration)
    return needed + machine.coulomb * np.sign(log.speed) + machine.viscous * log.speed


def move(
    rig: Rig,
    motion: Excitation | Trajectory,
    plan: Plan,
    run: Run,
    samples: int,
    conditions: Conditions = PLAIN,
) -> loop.Log:
    """Run the compiled loop."""
    machine = rig.machine
    leg, wearer = plan.with_lumps(machine.leg), None
    if run.has_human and plan.cuffs is None:
        leg = leg + rig.person.leg
    elif run.has_human:
        wearer = rig.person.leg
    body = Body(leg, wearer, plan.payload)
    # The hip's rotor turns with the thigh unless something soft is between them.
    mass = plan.added_mass + np.diag(
        [machine.hip_rotor if plan.transmission[HIP] == RIGID else 0.0, 0.0]
    )
    levers = np.array([*machine.cuff_distance, leg.length])
    cuffs = np.zeros((2, 6)) if plan.cuffs is None else per_metre(plan.cuffs, levers)
    joints = loop.Joints(
        machine.coulomb,
        machine.viscous,
        mass,
        plan.transmission,
        machine.rotors,
        plan.spring,
        cuffs,
        levers,
    )
    world = loop.World(leg.gravity, plan.tilt, np.array([body.payload, *plan.load], dtype=float))
    drive_counts = machine.counts if machine.drive_counts is None else machine.drive_counts
    drives = loop.Drives(
        machine.kp,
        machine.kd,
        machine.limit,
        2 * np.pi / drive_counts,
        plan.encoder_offset,
        plan.wobble,
        float(1.0 - np.exp(-2 * np.pi * SPEED_CUTOFF_HZ / DRIVE_RATE_HZ)),
        2 * np.pi / machine.counts,
    )
    excited = _excited(motion, samples * conditions.sample_s)
    log = empty_log(samples, conditions.ticks)
    loop.simulate(
        body.handles,
        excited,
        drives,
        joints,
        world,
        plan.hidden(),
        excited.theta0,
        samples,
        conditions.ticks,
        True,
        log,
    )
    if not np.isfinite(log.angle).all():
        raise FloatingPointError("the simulated leg became unstable")
    return log


def _excited(motion: Excitation | Trajectory, duration_s: float) -> loop.Excited:
    if isinstance(motion, Trajectory):
        none = np.zeros((2, 1))
        return loop.Excited(motion.middle, none, none, 1.0, motion.table(duration_s))
    a, b = np.ascontiguousarray(motion.a), np.ascontiguousarray(motion.b)
    return loop.Excited(motion.theta0, a, b, 2 * np.pi / PERIOD_S, np.zeros((0, 4)))


def empty_log(samples: int, ticks: int = loop.TICKS_PER_SAMPLE) -> loop.Log:
    """Return arrays for the loop to write into."""
    pairs = {
        name: np.zeros((samples, 2)) for name in loop.Log._fields if name not in ("link", "torque")
    }
    return loop.Log(**pairs, link=np.zeros((samples, 6)), torque=np.zeros((samples * ticks, 2)))


def _reported(log: loop.Log, time: NDArray, plan: Plan, conditions: Conditions) -> NDArray:
    """Pass the torque of each millisecond through the channel and average it over the samples (n,
    2)."""
    period = loop.DT * loop.STEPS_PER_TICK
    angle = None
    if plan.channel.needs_angle:
        ticks = np.arange(len(log.torque)) * period
        angle = np.column_stack([np.interp(ticks, time, log.angle[:, j]) for j in range(2)])
    out = through(plan.channel, log.torque, period, angle)
    return out.reshape(-1, conditions.ticks, 2).mean(axis=1)


def _ripple(machine: Machine, angle: NDArray, noise: Generator, conditions: Conditions) -> NDArray:
    """Error of the measured torque: coloured noise, and in some machines a part that depends on the
    motor's angle."""
    n = len(angle)
    out = np.empty((n, 2))
    for j in range(2):
        memory = np.exp(-conditions.sample_s / machine.ripple_time[j])
        white = noise.standard_normal(n) * np.sqrt(1.0 - memory**2)
        coloured, _ = lfilter([1.0], [1.0, -memory], white, zi=[memory * noise.standard_normal()])
        share = machine.ripple_share[j]
        with_angle = np.sqrt(2.0) * np.sin(machine.ripple_cycles[j] * angle[:, j])
        out[:, j] = machine.ripple[j] * (
            np.sqrt(1.0 - share) * coloured + np.sqrt(share) * with_angle
        )
    return out


def _cuff_forces(
    rig: Rig, plan: Plan, log: loop.Log, noise: Generator, conditions: Conditions = PLAIN
) -> NDArray:
    """Return the forces at four sensors (n, 4, 3) N."""
    along, across = np.zeros_like(log.cuff), log.cuff
    if plan.cuffs is None:
        along, across = _firmly_strapped(rig, plan, log, conditions)
    return pad_forces(rig, along, across, noise)


def _firmly_strapped(
    rig: Rig, plan: Plan, log: loop.Log, conditions: Conditions
) -> tuple[NDArray, NDArray]:
    """Return forces along and across thigh and shank: MuJoCo says what torque the wearer's own leg
    takes."""
    q, dq, ddq = (log.link[:, 2 * i : 2 * i + 2].copy() for i in range(3))
    base, sway, frequency = plan.tilt
    # Inertia does not depend on the hip's angle: gravity from elsewhere is a hip turned otherwise.
    q[:, HIP] += base + sway * np.sin(
        2 * np.pi * frequency * (np.arange(len(q)) + 0.5) * conditions.sample_s
    )
    return firm_forces(rig, q, Body(rig.person.leg).inverse(q, dq, ddq) + log.human)
