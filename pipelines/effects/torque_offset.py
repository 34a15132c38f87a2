"""A torque channel with a wrong zero."""

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side
from pipelines.effects.kernel import torque_reading


class TorqueOffset(Effect):
    """The measured torque is the true one plus a constant.

    A sensor that is tared at each start has another constant in each run.
    """

    name = "torque_offset"
    title = "Torque offset"
    side = Side.SENSOR
    family = Family.SENSOR
    needs_torque = True
    resembles = ("angle", "time")
    forms_differ = "a real zero creeps, and steps when the sensor is loaded"
    equation = "measured torque = true torque + offset"
    source = (
        "Janot, Vandanjon, Gautier (2014), IEEE Trans. Control Systems Technology 22(1): the drive"
        " chain's offset"
    )
    looks_like = "a residual whose mean is not zero, in motion or at rest"
    confirm = (
        "switch the drive off and read its torque: it should be zero; a sensor that is tared at"
        " each start reads zero then under any load: remove the load first"
    )
    # A lift's X2 contains every constant force.
    absorbed_as = "constant"
    element = Element.TORQUE_OFFSET
    may_differ = "a torque sensor that is tared at every start"
    linear = (Parameter("offset", "N·m", "measured less true torque", "o", (-4.0, 4.0)),)
    parity = Parity.EVEN

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Shift the torque."""
        torque[joint] += values[0]
