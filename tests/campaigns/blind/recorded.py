"""What every world simulates, and what it hands back: the rig, and one run with all that was true
in it."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tests.campaigns.blind.body import Leg
from tests.campaigns.blind.people import Person
from tests.campaigns.blind.plan import HIP, Plan, Run
from tests.campaigns.blind.smooth import TABLE
from tests.campaigns.blind.units import Units

REVERSAL_SPEED, REVERSAL_PADDING_S = 0.04, 0.08
BLOCK_S = 0.025
"""Length of a block average, near enough, in which sizes and noise floors are given."""
EDGE_S = 0.5


class PoweredLeg(Protocol):
    """What the machines of all worlds have. Arrays are hip, knee; SI units."""

    leg: Leg
    coulomb: NDArray
    viscous: NDArray
    hip_rotor: float
    counts: NDArray
    ripple: NDArray
    ripple_time: NDArray
    cuff_distance: tuple[float, float]

    def tuned_for_soft(self, joint: int) -> "PoweredLeg":
        """Return the machine with a drive tuned as a lab would tune it behind a soft
        transmission."""


@dataclass(frozen=True)
class Rig:
    """A machine and its wearer."""

    machine: PoweredLeg
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
    """What the sensors of one run say, and what they should have said; n samples."""

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
    """(n, 2) what is hidden, as torque: reported less what the faultless machine needs for the
    reported motion."""
    true_speed: NDArray
    link: NDArray
    """(n, 6) q, dq, ddq of hip and knee of the links."""
    weight: float = 0.0
    """Of the clean torque at the hip, what is held whatever the motion, N·m."""
    sample_s: float = 0.005
    temperature: NDArray | None = None
    """(n, 2) of the motors as recorded, degrees Celsius."""
    kept: NDArray | None = None
    """Which samples the recorder did not lose, (n,) bool; None where it lost none."""

    def away_from_reversals(self) -> NDArray:
        """(n, 2) bool, by the true speed."""
        slow = np.abs(self.true_speed) < REVERSAL_SPEED
        reach = np.ones(2 * round(REVERSAL_PADDING_S / self.sample_s) + 1)
        return np.column_stack([np.convolve(s, reach, mode="same") < 0.5 for s in slow.T])

    def blocks(self, x: NDArray) -> NDArray:
        """Average over blocks, (n, ...) to (n / samples of a block, ...)."""
        block = max(1, round(BLOCK_S / self.sample_s))
        n = len(x) // block
        return x[: n * block].reshape(n, block, *x.shape[1:]).mean(axis=1)

    def moving(self) -> NDArray:
        """Return which blocks are away from a joint's reversals and the run's ends, (m, 2) bool."""
        return self.blocks(self.moving_samples().astype(float)) == 1.0

    def moving_samples(self) -> NDArray:
        """Return the same for each sample and joint, (n, 2) bool."""
        away = self.away_from_reversals()
        edge = round(EDGE_S / self.sample_s)
        away[:edge] = away[-edge:] = False
        return away
