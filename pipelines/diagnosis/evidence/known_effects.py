"""What a machine is known to have besides its rigid body and friction: part of what everything is
held against.

Who built a machine knows its rotors and gears. Data need not show that they are there, only how
large they are.
"""

from collections.abc import Sequence

from pipelines.effects import Effect, Side
from pipelines.mechanics.machine import Machine
from pipelines.model import BASELINE
from pipelines.wording.label import effect_at


def known_effects(labels: Sequence[str], machine: Machine) -> tuple[Effect, ...]:
    """Return the effects of some labels, ``rotor_inertia@knee``, at a machine.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or drawings do not show it.
    """
    return tuple(
        effect_at(label, machine, _fits, "diagnose.known") for label in dict.fromkeys(labels)
    )


def _fits(effect: type[Effect]) -> bool:
    """Tell whether drawings show an effect, as an inertia, a spring or a mass, and only its linear
    parameters are open.

    How a joint rubs is on no drawing.
    """
    shown = effect.inertial or effect.side is Side.STRUCTURE
    return shown and effect.name not in BASELINE and bool(effect.linear) and not effect.shape
