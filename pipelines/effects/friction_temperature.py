"""Friction that depends on the temperature of the drive."""

from typing import ClassVar

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side, Tie
from pipelines.effects.kernel import reaction
from pipelines.mechanics.instant import REFERENCE_C


class FrictionTemperature(Effect):
    """Friction that changes with the recorded temperature, in all runs alike.

    The baseline's friction is then that at 25 °C. A run without temperatures does not show it. The
    virtual rig warms by its own ``[plant.temperature]``; other simulations use the recorded
    temperature, or 25 °C if there is none.
    """

    name = "friction_temperature"
    title = "Friction and temperature"
    side = Side.DRIVE
    family = Family.TIME
    resembles = ("friction_over_time", "speed")
    forms_differ = "viscosity falls exponentially, and the motor warms before the gear does"
    needs_temperature = True
    equation = "tau = (cv v + cs sgn(v)) (T - 25 °C), T the recorded temperature"
    source = "Bittencourt, Wernholt, Sander-Tavallaey, Brogårdh (2010), IROS: load and temperature"
    looks_like = "residual in step with speed whose size follows the motor's temperature"
    confirm = "repeat one motion from cold to warm, and plot friction against the temperature"
    ties: ClassVar = {
        "friction_warmup": Tie(
            "while a run warms steadily, its temperature and its time rise together",
            "repeat the motion with the drive warm: friction that follows the temperature is low"
            " from the start",
        ),
    }
    linear = (
        Parameter(
            "viscous_per_degree",
            "N·m·s/(rad·°C)",
            "change of viscous friction",
            "cv",
            (-0.4, 0.1),
        ),
        Parameter("coulomb_per_degree", "N·m/°C", "change of Coulomb friction", "cs", (-0.2, 0.1)),
    )
    parity = Parity.ODD

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add (cv v + cs sgn v) (T - 25 °C) at the joint."""
        level = values[0] * at.dq[joint] + values[1] * at.direction[joint]
        out[joint] += level * (at.temperature[joint] - REFERENCE_C)
