"""Friction proportional to the load on the gear's teeth."""

from dataclasses import replace

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import reaction


class LoadDependentFriction(Effect):
    """Dry friction that grows with the torque that the gear transmits."""

    name = "load_dependent_friction"
    title = "Load-dependent friction"
    side = Side.DRIVE
    family = Family.LOAD
    needs_torque = True
    resembles = ("load", "speed", "friction_by_angle")
    forms_differ = "a real share changes with the speed and along the gear"
    holds = True
    equation = "tau = mu abs(T) (sgn(v) + k sgn(T)), T the transmitted torque, k = 0 by default"
    source = (
        "Hamon, Gautier, Garrec (2010), IROS: dry friction depending on load and velocity, in four"
        " quadrants"
    )
    looks_like = "a square wave with the motion's direction whose height follows the load"
    confirm = (
        "hang weights on the joint, move it slowly both ways, and plot half the torque difference"
        " against the load; half the sum, less gravity, shows the driving excess"
    )
    linear = (
        Parameter(
            "load_coefficient", "1", "friction per unit of transmitted torque", "mu", (0.02, 0.3)
        ),
    )
    shape = (
        Parameter(
            "driving_excess",
            "1",
            "share by which friction is larger when the drive moves the load, and smaller when"
            " the load moves it",
            "k",
            (-1.0, 1.0),
            default=0.0,
            forms=(0.0, 0.5, -0.5),
        ),
    )
    dissipative = True  # for abs(k) <= 1
    reads_load = True

    def __post_init__(self) -> None:
        """Hold the excess at zero on a machine of one joint, where the rigid body absorbs it."""
        super().__post_init__()
        # There mu k T is a share of the rigid body's torque, as a gain would be.
        if len(self.on.names) == 1:
            (excess,) = self.shape
            object.__setattr__(self, "shape", (replace(excess, forms=(0.0,)),))

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add mu (abs(load) sgn v + k load) at the joint."""
        # abs(T) sgn(T) is T.
        load = at.load[joint]
        out[joint] += values[0] * (abs(load) * at.direction[joint] + values[1] * load)
