"""A torque channel with the wrong gain."""

from typing import ClassVar

from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Element, Family, Parameter, Side, Tie
from pipelines.effects.kernel import torque_reading
from pipelines.mechanics.motion import Motion


class TorqueGain(Effect):
    """The measured torque is the true one times a factor: a wrong torque constant or efficiency."""

    name = "torque_gain"
    title = "Torque gain"
    side = Side.SENSOR
    family = Family.SENSOR
    needs_torque = True
    resembles = ("load", "gain_over_time")
    forms_differ = "a real gain may differ with the sign of the torque, or fall at large ones"
    equation = "measured torque = gain * true torque"
    source = (
        "Gautier, Briot (2014), ASME J. Dyn. Sys. Meas. Control 136(5): identification of joint"
        " drive gains"
    )
    looks_like = (
        "the joints disagree about the second link: the parameters of both, X2 and X3, differ"
        " between the rows"
    )
    confirm = "hang a known weight on the joint and compare the change of torque with the weight's"
    # On a single joint, it scales all parameters alike.
    absorbed_as = "gain"
    element = Element.TORQUE_GAIN
    ties: ClassVar = {
        "torque_gain": Tie(
            "without another measurement of the load only the ratio of both gains shows: one too"
            " high looks like the other too low",
            "hang a known weight on each joint in turn; or record the cuff forces, with and without"
            " the person",
        ),
    }
    # Not linear: it multiplies the torques of all other effects.
    shape = (Parameter("gain", "1", "measured per true torque", "g", (0.7, 1.4)),)

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Multiply the torque."""
        torque[joint] *= values[0]

    def delivered(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        """Divide the torque of the joint, in (n, J) N·m, by the gain."""
        true = torque.copy()
        true[:, self.column(motion)] /= values[0]
        return true
