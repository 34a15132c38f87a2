"""The human joint's own stiffness towards the end of its range."""

from math import expm1
from typing import ClassVar

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side, Tie
from pipelines.effects.kernel import reaction


class PassiveJointTorque(Effect):
    """Ligaments and stretched muscles: a torque that grows exponentially beyond an angle.

    One formula covers both ends of the range: a negative width acts below the onset. A large width
    is a linear spring beyond the onset, a small one a hard stop.
    """

    name = "passive_joint_torque"
    title = "Passive joint torque"
    side = Side.HUMAN
    family = Family.PERSON
    limits_travel = True
    resembles = ("angle", "both_angles")
    forms_differ = "real muscles cross the next joint too, and lose energy when they are stretched"
    equation = "tau = k w (exp((q - q0) / w) - 1) beyond q0 on the side of w's sign, else 0"
    source = (
        "Riener, Edrich (1999), J. Biomechanics 32(5): passive elastic joint moments in the lower"
        " extremities"
    )
    looks_like = (
        "residual against angle: flat, then steep at one end of the range; only with the human"
    )
    confirm = (
        "move the relaxed leg slowly to that end of its range and watch torque and cuff forces"
    )
    ties: ClassVar = {
        "end_stop": Tie(
            "with the person in every run, a stop of the machine and one of the person's joint are"
            " alike",
            "record the machine with nobody in it through the same range",
        ),
    }
    acts_in = ("with_human",)
    linear = (Parameter("stiffness", "N·m/rad", "torque per angle at the onset", "k", (2.0, 60.0)),)
    shape = (
        Parameter("onset_angle", "rad", "angle beyond which it acts", "q0", (-1.6, 0.9)),
        Parameter(
            "width",
            "rad",
            "travel over which it grows e-fold; its sign is the side it acts on",
            "w",
            (-0.4, 0.4),
            default=0.25,
            # A usual width, a hard stop and a linear spring, at either end of the range.
            forms=(0.25, -0.25, 0.1, -0.1, 5.0, -5.0),
            between_forms=False,
        ),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add k w (exp((q - q0) / w) - 1) beyond the onset."""
        beyond = (at.q[joint] - values[1]) / values[2]
        if beyond > 0.0:
            # With the largest width the exponent is small, and exp(x) - 1 would lose digits.
            out[joint] += values[0] * values[2] * expm1(beyond)
