"""The rotor that a moving link carries: it turns with the link and within it."""

from typing import ClassVar

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class RotorCoupling(Effect):
    """The knee's motor on the thigh, its axis parallel to the joints'.

    A rotor of inertia Ir behind a gear of ratio N has the energy Ir (dq1 + N dq2)² / 2. It adds Ir
    to X1, the rotor inertia J = N² Ir at the knee, and between the joints this coupling c = N Ir,
    which is negative if the gear reverses.

    No motion separates it from the others: X2's column is the sum of this one's and
    ``rotor_inertia``'s. A fit returns X2 + c and J - c, the same torques with c = 0. So ``exoid
    diagnose`` names ``rotor_inertia``; for a rotor of known Ir and N, its value is (N² - N) Ir.
    """

    name = "rotor_coupling"
    title = "Rotor coupling"
    side = Side.STRUCTURE
    family = Family.TRANSMISSION
    resembles = ("inertia_by_angle",)
    forms_differ = "a real rotor sits behind a gear that twists"
    equation = "tau1 = c ddq2, tau2 = c ddq1; c = N Ir"
    source = (
        "Sciavicco, Siciliano, Villani (1996), Advanced Robotics 10(3): motor inertia in"
        " gear-driven manipulators"
    )
    looks_like = (
        "no signature of its own: the second rotor's inertia is smaller by c, and X2 larger by c"
    )
    confirm = (
        "look up rotor inertia and gear ratio, and which way the gear turns: c is their product"
    )
    joints = ("knee",)
    absorbed: ClassVar = {"knee": "X2 and rotor_inertia together"}
    linear = (Parameter("coupling", "kg·m²", "rotor inertia times gear ratio", "c", (-0.3, 0.3)),)
    inertial = True
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add c ddq of the other joint at each."""
        # Alike at both joints, because a mass matrix is symmetric.
        out[0] += values[0] * at.ddq[1]
        out[1] += values[0] * at.ddq[0]
