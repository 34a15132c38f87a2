"""Margins between an excitation and the bounds of its joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.design import JointBounds

QUANTITIES = ("angle", "velocity", "acceleration")


@dataclass(frozen=True)
class Margin:
    """The range of one joint in one quantity, with its bounds."""

    joint: str
    quantity: str
    unit: str
    low: float
    high: float
    """Upper bound."""
    lowest: float
    highest: float
    """Greatest value of the motion, between samples too."""

    @property
    def margin(self) -> float:
        """Distance to the nearer bound; negative beyond it."""
        return min(self.lowest - self.low, self.high - self.highest)

    @property
    def kept(self) -> bool:
        """Whether the motion stays within the bounds."""
        # Excess over a bound that is rounding error.
        tolerance = 1e-9
        return self.margin >= -tolerance

    def __str__(self) -> str:
        """Describe the margin in one sentence."""
        return (
            f"{self.joint} {self.quantity} goes from {self.lowest:.4g} to {self.highest:.4g}"
            f" {self.unit}, allowed is {self.low:g} to {self.high:g}"
        )


def bounds_array(bounds: JointBounds) -> NDArray:
    """Return the bounds of a leg's motion.

    Parameters
    ----------
    bounds : JointBounds
        Limits of hip and knee.

    Returns
    -------
    (3, 2, 2) array
        Angle, velocity, acceleration (rad, rad/s, rad/s²); hip, knee; low, high.
    """
    table = [
        [j.angle_rad for j in (bounds.hip, bounds.knee)],
        [(-j.velocity_rad_s, j.velocity_rad_s) for j in (bounds.hip, bounds.knee)],
        [(-j.acceleration_rad_s2, j.acceleration_rad_s2) for j in (bounds.hip, bounds.knee)],
    ]
    return np.array(table)


def margins(trajectory: Trajectory, bounds: JointBounds) -> list[Margin]:
    """Return each joint's margin in angle, velocity and acceleration, between samples too.

    Parameters
    ----------
    trajectory : Trajectory
        Motion of hip and knee.
    bounds : JointBounds
        Limits of hip and knee.

    Returns
    -------
    list of Margin
        Six margins, in rad, rad/s and rad/s².
    """
    # Last axis: lower and upper bound, then least and greatest value, as in the fields of Margin.
    numbers = np.concatenate([bounds_array(bounds), trajectory.extrema()], axis=2).tolist()
    return [
        Margin(joint.name, quantity, joint.unit(quantity), *numbers[i][j])
        for j, joint in enumerate(trajectory.joints)
        for i, quantity in enumerate(QUANTITIES)
    ]
