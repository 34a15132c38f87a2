"""A torque channel that also measures the other joint's torque."""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import torque_reading
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion


class TorqueCrossTalk(Effect):
    """A sensor strained by the other joint's load, or two current channels that couple."""

    name = "torque_cross_talk"
    title = "Torque cross-talk"
    side = Side.SENSOR
    family = Family.SENSOR
    needs_torque = True
    resembles = ("other_load", "both_angles", "other_angle")
    forms_differ = "a real sensor may also measure bending forces, which no joint torque represents"
    equation = "measured torque = true torque + c * true torque of the other joint"
    source = "Hirose, Yoneda (1990), ICRA: optical six-axial force sensor, interference of its axes"
    looks_like = "residual in step with the other joint's torque, friction steps included"
    confirm = "hold this joint without load, load the other one with a weight, and read this torque"
    shape = (Parameter("coupling", "1", "share of the other joint's torque", "c", (-0.2, 0.2)),)

    @classmethod
    def possible(cls, machine: Machine) -> list[str | None]:
        """Return the joints of a machine with two drives of one kind; empty for other machines."""
        # Between a torque and a force, the share would have a unit. Both torques must be readings.
        kinds = [joint.kind for joint in machine.joints if joint.has_sensor]
        two_alike = len(machine.joints) == len(kinds) == 2 and kinds[0] == kinds[1]
        return super().possible(machine) if two_alike else []

    def directions(self, motions: Sequence[Motion]) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Return one small coupling; the effect is proportional to it."""
        return (((0.05,),),)

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Add a share of the other joint's torque."""
        torque[joint] += values[0] * torque[1 - joint]

    def delivered(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        """Subtract the other joint's share of the torques (n, J), N·m."""
        true, j = torque.copy(), self.column(motion)
        true[:, j] -= values[0] * torque[:, 1 - j]
        return true
