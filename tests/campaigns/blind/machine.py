"""Random exoskeletons: links, friction, drives, encoders, and how well torque and forces are
measured."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind.body import Leg, Segment

SPEED_CUTOFF_HZ = 40.0
DRIVE_RATE_HZ = 1000.0
KNEE_ROTOR = 0.04
"""kg·m², with an effect behind a soft transmission only; one with an effect elsewhere is to be
hidden."""
SOFT_DAMPING = 150.0
"""Most damping per motor inertia, 1/s, with which drives behind a soft transmission do not hunt."""
CHATTER_NM = 0.8
"""Damping torque of one encoder count: a coarse encoder allows little damping."""


@dataclass(frozen=True)
class Machine:
    """A powered leg. Arrays are hip, knee; SI units."""

    leg: Leg
    coulomb: NDArray
    viscous: NDArray
    hip_rotor: float
    kp: NDArray
    kd: NDArray
    limit: NDArray
    counts: NDArray
    """Encoder counts per turn of the joint."""
    ripple: NDArray
    """RMS of the error of the measured torque, N·m."""
    ripple_time: NDArray
    """Its correlation time, s."""
    ripple_cycles: NDArray
    """Cycles per turn of the part of it that depends on the motor's angle."""
    ripple_share: NDArray
    """Share of the ripple's power that depends on the motor's angle."""
    cuff_distance: tuple[float, float]
    cuff_zero: NDArray
    """(4, 3) N."""
    cuff_noise: float
    carried: float
    """Share of the limb's weight that the cuffs carry along it."""
    preload: float
    drive_counts: NDArray | None = None
    """Counts that the drives see, where they count on the motor's side."""

    @property
    def rotors(self) -> NDArray:
        """Reflected inertia of the motors, (2,) kg·m²."""
        return np.array([self.hip_rotor, KNEE_ROTOR])

    def tuned_for_soft(self, joint: int) -> "Machine":
        """Return the machine with the drive of a joint tuned as a lab would tune it behind a soft
        transmission."""
        kd = self.kd.copy()
        kd[joint] = min(kd[joint], SOFT_DAMPING * self.rotors[joint])
        return replace(self, kd=kd)

    def controller(self, joint: int) -> dict:
        """Return what a recording says of a drive."""
        return {
            "type": "pd",
            "kp_nm_rad": float(self.kp[joint]),
            "kd_nm_s_rad": float(self.kd[joint]),
            "rate_hz": DRIVE_RATE_HZ,
            "limit_nm": float(self.limit[joint]),
        }


def random_rich_machine(rng: Generator, thigh_length: float) -> Machine:
    """Draw an exoskeleton whose encoders and torques are as different as labs have them."""
    drawn = random_machine(rng, thigh_length)
    counts = np.round(2.0 ** rng.uniform(12.0, 20.0, 2))
    return replace(
        drawn,
        counts=counts,
        # Coarse ones are for the record: a drive counts on its motor's side.
        drive_counts=np.maximum(counts, drawn.counts),
        ripple=np.exp(rng.uniform(np.log(0.1), np.log(1.5), 2)),
        ripple_time=np.exp(rng.uniform(np.log(0.002), np.log(0.2), 2)),
        # Finer than any line of the catalogue's cogging.
        ripple_cycles=rng.integers(500, 1500, 2).astype(float),
    )


def random_machine(rng: Generator, thigh_length: float) -> Machine:
    """Draw an exoskeleton for a thigh of this length."""
    thigh_mass, shank_mass = rng.uniform(2.5, 5.0), rng.uniform(1.5, 3.0)
    leg = Leg(
        Segment(
            thigh_mass, rng.uniform(0.35, 0.6) * thigh_length, thigh_mass * rng.uniform(0.01, 0.02)
        ),
        Segment(shank_mass, rng.uniform(0.12, 0.24), shank_mass * rng.uniform(0.008, 0.02)),
        thigh_length,
    )
    counts = np.round(2.0 ** rng.uniform(14.0, 19.0, 2))
    fine = CHATTER_NM / (2 * np.pi / counts * 2 * np.pi * SPEED_CUTOFF_HZ)
    return Machine(
        leg=leg,
        coulomb=rng.uniform([1.0, 1.0], [4.0, 4.5]),
        viscous=rng.uniform([1.5, 1.5], [5.0, 6.0]),
        hip_rotor=rng.uniform(0.05, 0.4),
        kp=rng.uniform([700.0, 300.0], [1500.0, 700.0]),
        kd=np.minimum(rng.uniform([30.0, 10.0], [60.0, 25.0]), fine),
        limit=np.array([200.0, 200.0]),
        counts=counts,
        ripple=rng.uniform(0.3, 1.0, 2),
        ripple_time=np.exp(rng.uniform(np.log(0.004), np.log(0.05), 2)),
        ripple_cycles=rng.integers(150, 600, 2).astype(float),
        ripple_share=np.where(rng.random(2) < 0.4, rng.uniform(0.05, 0.25, 2), 0.0),
        cuff_distance=(rng.uniform(0.5, 0.7) * thigh_length, rng.uniform(0.18, 0.26)),
        cuff_zero=rng.normal(0.0, 1.5, (4, 3)),
        cuff_noise=rng.uniform(0.2, 0.8),
        carried=rng.uniform(0.0, 0.3),
        preload=rng.uniform(5.0, 25.0),
    )
