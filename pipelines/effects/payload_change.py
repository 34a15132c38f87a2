"""A mass that comes or goes during a run."""

from dataclasses import replace

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.mechanics.machine import THE_LEG
from pipelines.mechanics.mechanisms.leg import LEG


class PayloadChange(Effect):
    """A point mass on the segment's axis from some time on; negative if it is lost.

    At a prismatic joint, it is a mass.
    """

    name = "payload_change"
    title = "Payload change"
    side = Side.STRUCTURE
    family = Family.TIME
    resembles = ("angle", "both_angles", "time")
    forms_differ = "a real load is picked up over a second or so, and may swing"
    equation = (
        "tau = p (t >= t0) dA/dp, p = m r; shank: A3 + r A2 + (r + L1²/r) A1 + L1/r A4; thigh: A4 +"
        " r A1"
    )
    source = (
        "Khalil, Gautier, Lemoine (2007), ICRA: identification of the payload inertial parameters"
    )
    looks_like = "gravity residual that begins at one instant and stays"
    confirm = "ask what was picked up or fell off at that time, and weigh it"
    mechanism_equation = "payload"
    may_be_worn = True
    linear = (
        Parameter("mass_moment", "kg·m", "mass times distance along the segment", "p", (-1.0, 1.0)),
    )
    shape = (
        Parameter(
            "time", "s", "when it is added, from the run's start", "t0", (0.0, 120.0), per_run=True
        ),
        Parameter(
            "distance", "m", "from the segment's joint to the mass", "r", (0.1, 0.45), default=0.3
        ),
    )
    inertial = True
    parity = Parity.EVEN
    reaction = staticmethod(LEG.reactions[mechanism_equation])

    def __post_init__(self) -> None:
        """Use a mass at a prismatic joint, where no distance matters."""
        super().__post_init__()
        if self.joint and self.on != THE_LEG and self.on.joint(self.joint).kind == "prismatic":
            # The torque of a mass on a slide is m (ddq + g), wherever it lies.
            moment, time = self.linear[0], self.shape[0]
            object.__setattr__(self, "linear", (replace(moment, meaning="added mass", symbol="m"),))
            object.__setattr__(self, "shape", (time,))
