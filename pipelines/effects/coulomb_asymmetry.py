"""Dry friction that differs with direction."""

from typing import ClassVar

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side, Tie
from pipelines.effects.kernel import reaction


class CoulombAsymmetry(Effect):
    """More Coulomb friction in one direction than in the other."""

    name = "coulomb_asymmetry"
    title = "Coulomb asymmetry"
    side = Side.DRIVE
    family = Family.SPEED
    resembles = ("speed",)
    forms_differ = "a real level may also change with load or with the angle"
    holds = True
    equation = "tau = a abs(sgn v): Ks + a forward, Ks - a backward"
    source = (
        "Janot, Vandanjon, Gautier (2014), IEEE Trans. Control Systems Technology 22(1): the drive"
        " chain's offset"
    )
    looks_like = "a constant while the joint moves in either direction, and zero at standstill"
    confirm = (
        "move the empty joint slowly both ways through the same range: the mean torque less gravity"
        " is the asymmetry"
    )
    # While a joint moves, it is a constant torque, which is part of a lift's X2.
    absorbed_as = "constant"
    ties: ClassVar = {
        "torque_offset": Tie(
            "while the joint always moves, a friction that differs with direction adds the same"
            " constant torque",
            "hold the joint still and read the torque with the drive off: an offset of the sensor"
            " stays",
        ),
    }
    linear = (
        Parameter(
            "asymmetry", "N·m", "half of forward less backward Coulomb friction", "a", (-3.0, 3.0)
        ),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add a abs(sgn v) at the joint."""
        out[joint] += values[0] * abs(at.direction[joint])
