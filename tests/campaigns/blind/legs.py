"""A closed-form leg as a plan has it: the torque it needs, and the forces at its cuffs.

The worlds without MuJoCo share it.
"""

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from tests.campaigns.blind import two_link
from tests.campaigns.blind.cuffs import firm_forces, pad_forces
from tests.campaigns.blind.plan import HIP, Plan, Run
from tests.campaigns.blind.recorded import Rig

FOLLOWED_HZ = 12.0
FASTEST_RAD = 10.0
"""An angle that no leg reaches: the simulation has become unstable."""
HUNTING_NM = 4.0
"""RMS change of a drive's torque from one millisecond to the next: it hunts, and no lab would
record that."""


class Links(NamedTuple):
    """Coefficients of the driven leg and of a wearer's own (``own`` 0 where there is none), and the
    base."""

    driven: np.ndarray
    wearer: np.ndarray
    own: int
    length: float
    gravity: float
    tilt: np.ndarray
    payload: np.ndarray
    """Joint (-1 for none), distance, mass, start, ramp, direction."""


def links_of(rig: Rig, plan: Plan, run: Run) -> Links:
    """Return the leg of a run, with the wearer's as a part of it unless the plan has cuffs."""
    leg, own = rig.machine.leg, False
    driven = two_link.coefficients(plan.with_lumps(leg))
    if run.has_human:
        own = plan.cuffs is not None
        if not own:
            driven = driven + two_link.coefficients(rig.person.leg)
    payload = np.array([-1.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    if plan.payload:
        payload = np.array([plan.payload.joint, plan.payload.distance, *plan.load])
    wearer = two_link.coefficients(rig.person.leg)
    return Links(driven, wearer, int(own), leg.length, leg.gravity, plan.tilt, payload)


class Reported(NamedTuple):
    """A motion as the encoders read it, (n, 2) each, and that of the links behind the motors."""

    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    link_acceleration: np.ndarray
    """Mean over the time around each sample."""
    wound: np.ndarray
    """Angle of the motor less the link's, mean over the time around each sample."""


def needed(rig: Rig, run: Run, motion: Reported, trembling: NDArray, sample_s: float) -> NDArray:
    """Return the torque that the faultless machine needs for a reported motion, (n, 2) N·m.

    Parameters
    ----------
    trembling : (2,) array of bool
        Joints whose motor trembles alone: there the leg follows only what is slow.
    """
    m = rig.machine
    acceleration = motion.acceleration.copy()
    if trembling.any():
        followed = butter(2, FOLLOWED_HZ, fs=1.0 / sample_s, output="sos")
        wound = sosfiltfilt(followed, motion.wound[:, trembling], axis=0)
        behind = sosfiltfilt(followed, motion.link_acceleration[:, trembling], axis=0)
        winding = np.gradient(np.gradient(wound, sample_s, axis=0), sample_s, axis=0)
        acceleration[:, trembling] = behind + winding
    c = two_link.coefficients(rig.leg(run))
    upright = np.zeros(len(motion.angle))
    torque = two_link.inverse(c, m.leg.gravity, upright, motion.angle, motion.speed, acceleration)
    torque[:, HIP] += m.hip_rotor * acceleration[:, HIP]
    torque += m.rotors * (motion.acceleration - acceleration)
    return torque + m.coulomb * np.sign(motion.speed) + m.viscous * motion.speed


def cuff_forces(
    rig: Rig,
    plan: Plan,
    link: NDArray,
    human: NDArray,
    across: NDArray | None,
    t: NDArray,
    noise: Generator,
) -> NDArray:
    """Return forces at four sensors (n, 4, 3) N; ``across`` (n, 2) is known for soft cuffs."""
    if across is not None:
        return pad_forces(rig, np.zeros_like(across), across, noise)
    base, sway, frequency = plan.tilt
    tilt = base + sway * np.sin(2 * np.pi * frequency * t)
    q, dq, ddq = (np.ascontiguousarray(link[:, 2 * i : 2 * i + 2]) for i in range(3))
    c = two_link.coefficients(rig.person.leg)
    torque = two_link.inverse(c, rig.machine.leg.gravity, tilt, q, dq, ddq) + human
    upright = q + np.column_stack([tilt, np.zeros_like(tilt)])
    return pad_forces(rig, *firm_forces(rig, upright, torque), noise)


def check(angle: NDArray, torque: NDArray) -> None:
    """Raise FloatingPointError where a leg ran away or its drives hunt; ``torque`` each
    millisecond."""
    if not np.isfinite(angle).all() or np.abs(angle).max() > FASTEST_RAD:
        raise FloatingPointError("the simulated leg became unstable")
    if np.sqrt(np.mean(np.diff(torque, axis=0) ** 2, axis=0)).max() > HUNTING_NM:
        raise FloatingPointError("a simulated drive hunts")
