"""A torque channel whose zero wanders."""

from dataclasses import replace
from typing import ClassVar

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side, Tie
from pipelines.effects.kernel import torque_reading
from pipelines.effects.torque_offset import TorqueOffset


class TorqueDrift(Effect):
    """The measured torque is the true one plus an offset that grows with time."""

    name = "torque_drift"
    title = "Torque drift"
    side = Side.SENSOR
    family = Family.TIME
    needs_torque = True
    resembles = ("time",)
    forms_differ = "a real zero wanders to and fro, and settles as the electronics warm"
    equation = "measured torque = true torque + level + rate t"
    source = "Fraden (2016), Handbook of Modern Sensors, 5th ed., ch. 3 (zero drift)"
    looks_like = "a residual that climbs through the run and does not repeat from period to period"
    confirm = "switch the drive off and read its torque for some minutes while the electronics warm"
    ties: ClassVar = {
        "torque_offset": Tie(
            "over runs this short a drift is an offset that differs from run to run",
            "record longer, or read the torque at rest before and after each run",
        ),
    }
    linear = (
        Parameter("rate", "N·m/s", "growth of the offset", "d", (-0.1, 0.1)),
        Parameter(
            "level",
            "N·m",
            "offset when the run begins",
            "o",
            (-4.0, 4.0),
            per_run=True,
            default=0.0,
        ),
    )
    parity = Parity.EVEN

    def __post_init__(self) -> None:
        """Set the level to zero if the mechanism's parameters absorb a constant torque."""
        super().__post_init__()
        if TorqueOffset.absorbed_as in self.on.mechanism.absorbs:
            # As a shape with a single form, the level is held at zero by every fit.
            rate, level = self.linear
            object.__setattr__(self, "linear", (rate,))
            object.__setattr__(self, "shape", (replace(level, per_run=False, forms=(0.0,)),))

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Add the accumulated offset to the torque."""
        torque[joint] += values[0] * t + values[1]
