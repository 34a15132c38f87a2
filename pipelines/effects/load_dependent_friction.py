"""Friction in proportion to the load on the gear's teeth."""

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class LoadDependentFriction(Effect):
    """Dry friction that grows with the torque that the gear transmits."""

    name = "load_dependent_friction"
    title = "Load-dependent friction"
    side = Side.DRIVE
    family = Family.LOAD
    resembles = ("load", "speed", "friction_by_angle")
    forms_differ = "a real share differs between driving a load and being driven by it"
    holds = True
    equation = "tau = mu abs(transmitted torque) sgn(v)"
    source = "Hamon, Gautier, Garrec (2010), IROS: dry friction depending on load and velocity"
    looks_like = "a square wave with the motion's direction whose height follows the load"
    confirm = "hang weights on the joint, move it slowly both ways, and plot half the difference against the load"
    linear = (Parameter("load_coefficient", "1", "friction per unit of transmitted torque", "mu", (0.02, 0.3)),)
    parity = Parity.ODD
    dissipative = True
    reads_load = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add mu abs(load) sgn v at the joint."""
        out[joint] += values[0] * abs(at.load[joint]) * at.direction[joint]
