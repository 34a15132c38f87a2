"""One run on the simulated rig: build the leg with what is hidden in it, move it, and measure."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt

from tests.blind import loop
from tests.blind.body import Body, Leg
from tests.blind.excitation import PERIOD_S, Excitation
from tests.blind.machine import DRIVE_RATE_HZ, SPEED_CUTOFF_HZ, Machine
from tests.blind.people import Person
from tests.blind.plan import HIP, Plan, Run
from tests.blind.smooth import TABLE
from tests.blind.units import Units

REVERSAL_SPEED, REVERSAL_PADDING_S = 0.04, 0.08
FOLLOWED = butter(2, 12.0, fs=1.0 / loop.SAMPLE_S, output="sos")


@dataclass(frozen=True)
class Rig:
    """A machine and its wearer."""

    machine: Machine
    person: Person
    units: Units = field(default_factory=Units)
    weight: float = 0.0
    """What the first drive holds at rest whatever the angle, as a lift's does, N·m."""

    def load(self, plan: Plan) -> None:
        """Put what has a weight of its own on the first drive."""
        if self.weight:
            plan.torque(TABLE, HIP, self.weight, table=np.ones(2))

    def leg(self, run: Run) -> Leg:
        """Return what moves in a kind of run, nothing hidden."""
        return self.machine.leg + self.person.leg if run.has_human else self.machine.leg


@dataclass(frozen=True)
class Recorded:
    """What the sensors of one run say, and what they should have said. n samples at 200 Hz."""

    run: Run
    time: NDArray
    angle: NDArray
    torque: NDArray
    reference: NDArray
    drive_speed: NDArray
    forces: NDArray | None
    """(n, 4, 3)."""
    clean_torque: NDArray
    """As the channel would report it without ripple."""
    effect: NDArray
    """(n, 2) what is hidden, as torque: reported less what the faultless machine needs for the reported motion."""
    true_speed: NDArray
    link: NDArray
    """(n, 6) q, dq, ddq of hip and knee of the links."""
    weight: float = 0.0
    """Of the clean torque at the hip, what is held whatever the motion, N·m."""

    def away_from_reversals(self) -> NDArray:
        """(n, 2) bool, by the true speed."""
        slow = np.abs(self.true_speed) < REVERSAL_SPEED
        reach = np.ones(2 * round(REVERSAL_PADDING_S / loop.SAMPLE_S) + 1)
        return np.column_stack([np.convolve(s, reach, mode="same") < 0.5 for s in slow.T])


def record(rig: Rig, excitation: Excitation, plan: Plan, run: Run, noise: Generator) -> Recorded:
    """Simulate and measure one run."""
    machine = rig.machine
    n = round(run.duration_s / loop.SAMPLE_S)
    log = move(rig, excitation, plan, run, n)
    t = (np.arange(n) + 0.5) * loop.SAMPLE_S
    clean = _reported(log.torque, plan)
    needed = _needed(rig, plan, run, log)
    forces = _cuff_forces(rig, plan, log, noise) if run.has_human else None
    return Recorded(
        run=run,
        time=t,
        angle=log.reading,
        torque=clean + _ripple(machine, log.angle, noise),
        reference=log.reference,
        drive_speed=log.drive_speed,
        forces=forces,
        clean_torque=clean,
        effect=clean - needed,
        true_speed=log.speed,
        link=log.link,
        weight=rig.weight,
    )


def _needed(rig: Rig, plan: Plan, run: Run, log: loop.Log) -> NDArray:
    """Torque that the faultless machine needs for the reported motion, encoder's errors and all, (n, 2) N·m."""
    machine = rig.machine
    acceleration = log.acceleration.copy()
    soft = plan.transmission != loop.RIGID
    # A motor behind something soft trembles alone; the leg follows only what is slower.
    acceleration[:, soft] = sosfiltfilt(FOLLOWED, acceleration[:, soft], axis=0)
    needed = Body(rig.leg(run)).inverse(log.angle, log.speed, acceleration)
    needed[:, HIP] += machine.hip_rotor * acceleration[:, HIP] + rig.weight
    needed += machine.rotors * (log.acceleration - acceleration)
    return needed + machine.coulomb * np.sign(log.speed) + machine.viscous * log.speed


def move(rig: Rig, excitation: Excitation, plan: Plan, run: Run, samples: int) -> loop.Log:
    """Run the compiled loop."""
    machine = rig.machine
    leg, wearer = machine.leg, None
    for joint, lump in plan.lumps:
        leg = replace(leg, **{_NAMES[joint]: getattr(leg, _NAMES[joint]) + lump})
    if run.has_human and plan.cuffs is None:
        leg = leg + rig.person.leg
    elif run.has_human:
        wearer = rig.person.leg
    body = Body(leg, wearer, plan.payload)
    # The hip's rotor turns with the thigh unless something soft is between them.
    mass = plan.added_mass + np.diag([machine.hip_rotor if plan.transmission[HIP] == loop.RIGID else 0.0, 0.0])
    levers = np.array([*machine.cuff_distance, leg.length])
    cuffs = np.zeros((2, 3)) if plan.cuffs is None else plan.cuffs / levers[:2, np.newaxis] ** 2
    joints = loop.Joints(
        machine.coulomb, machine.viscous, mass, plan.transmission, machine.rotors, plan.spring, cuffs, levers
    )
    world = loop.World(leg.gravity, plan.tilt, np.array([body.payload, *plan.load], dtype=float))
    drives = loop.Drives(
        machine.kp, machine.kd, machine.limit, 2 * np.pi / machine.counts, plan.encoder_offset, plan.wobble,
        float(1.0 - np.exp(-2 * np.pi * SPEED_CUTOFF_HZ / DRIVE_RATE_HZ)),
    )  # fmt: skip
    excited = loop.Excited(
        excitation.theta0, np.ascontiguousarray(excitation.a), np.ascontiguousarray(excitation.b), 2 * np.pi / PERIOD_S
    )
    log = empty_log(samples)
    loop.simulate(
        body.handles, excited, drives, joints, world, plan.hidden(), excitation.theta0, samples, True, log
    )  # fmt: skip
    if not np.isfinite(log.angle).all():
        raise FloatingPointError("the simulated leg became unstable")
    return log


_NAMES = ("thigh", "shank")


def empty_log(samples: int) -> loop.Log:
    """Return arrays for the loop to write into."""
    pairs = {name: np.zeros((samples, 2)) for name in loop.Log._fields if name not in ("link", "torque")}
    return loop.Log(**pairs, link=np.zeros((samples, 6)), torque=np.zeros((samples * loop.TICKS_PER_SAMPLE, 2)))


def _reported(ticks: NDArray, plan: Plan) -> NDArray:
    """Pass the torque of each millisecond (5 n, 2) through the channel and average it over the samples (n, 2)."""
    channel = plan.channel
    period = loop.SAMPLE_S / loop.TICKS_PER_SAMPLE
    t = np.arange(len(ticks)) * period
    torque = ticks @ (np.eye(2) + channel.cross).T
    out = np.empty_like(torque)
    for j in range(2):
        x = np.interp(t - channel.delay_s[j], t, torque[:, j])
        if channel.lag_s[j] > 0:
            share = 1.0 - np.exp(-period / channel.lag_s[j])
            x, _ = lfilter([share], [1.0, share - 1.0], x, zi=[(1.0 - share) * x[0]])
        change, time = channel.fade[j]
        fade = change * (1.0 - np.exp(-t / time)) if time > 0 else 0.0
        x = x * (channel.gain[j] + channel.bend[j] * np.abs(x) + fade) + channel.offset[j]
        moving = channel.moving_offset[j]
        out[:, j] = x + moving(t) if moving else x
    return out.reshape(-1, loop.TICKS_PER_SAMPLE, 2).mean(axis=1)


def _ripple(machine: Machine, angle: NDArray, noise: Generator) -> NDArray:
    """Error of the measured torque: coloured noise, and in some machines a part that goes with the motor's angle."""
    n = len(angle)
    out = np.empty((n, 2))
    for j in range(2):
        memory = np.exp(-loop.SAMPLE_S / machine.ripple_time[j])
        white = noise.standard_normal(n) * np.sqrt(1.0 - memory**2)
        coloured, _ = lfilter([1.0], [1.0, -memory], white, zi=[memory * noise.standard_normal()])
        share = machine.ripple_share[j]
        with_angle = np.sqrt(2.0) * np.sin(machine.ripple_cycles[j] * angle[:, j])
        out[:, j] = machine.ripple[j] * (np.sqrt(1.0 - share) * coloured + np.sqrt(share) * with_angle)
    return out


def _cuff_forces(rig: Rig, plan: Plan, log: loop.Log, noise: Generator) -> NDArray:
    """What four sensors feel (n, 4, 3) N: thigh front and back, shank front and back; distal, forward, lateral."""
    machine = rig.machine
    along, across = _firmly_strapped(rig, plan, log) if plan.cuffs is None else (np.zeros_like(log.cuff), log.cuff)
    forces = np.zeros((len(across), 4, 3))
    for i in range(2):
        # The back pushes forward, the front backward: pads press, they never pull.
        pressed = np.abs(across[:, i]) + machine.preload
        forces[:, 2 * i, 1] = 0.5 * (across[:, i] - pressed)
        forces[:, 2 * i + 1, 1] = 0.5 * (across[:, i] + pressed)
        forces[:, 2 * i : 2 * i + 2, 0] = 0.5 * along[:, i : i + 1]
    return forces + machine.cuff_zero + noise.normal(0.0, machine.cuff_noise, forces.shape)


def _firmly_strapped(rig: Rig, plan: Plan, log: loop.Log) -> tuple[NDArray, NDArray]:
    """Forces along and across thigh and shank, (n, 2) N each, when the wearer's leg moves as the machine does.

    MuJoCo says what torque the wearer's own leg takes, on a tilted base too; forces follow from the levers, the
    shank's first.
    """
    machine, leg = rig.machine, rig.person.leg
    q, dq, ddq = (log.link[:, 2 * i : 2 * i + 2].copy() for i in range(3))
    base, sway, frequency = plan.tilt
    # Inertia does not depend on the hip's angle: gravity from elsewhere is a hip turned otherwise.
    q[:, HIP] += base + sway * np.sin(2 * np.pi * frequency * (np.arange(len(q)) + 0.5) * loop.SAMPLE_S)
    torque = Body(leg).inverse(q, dq, ddq) + log.human
    thigh_lever, shank_lever = machine.cuff_distance
    weight = machine.carried * leg.gravity
    along_thigh = -weight * leg.thigh.mass * np.cos(q[:, 0])
    along_shank = -weight * leg.shank.mass * np.cos(q.sum(axis=1))
    across_shank = torque[:, 1] / shank_lever
    at_knee = across_shank * np.cos(q[:, 1]) + along_shank * np.sin(q[:, 1])
    across_thigh = (torque[:, 0] - torque[:, 1] - leg.length * at_knee) / thigh_lever
    return np.column_stack([along_thigh, along_shank]), np.column_stack([across_thigh, across_shank])
