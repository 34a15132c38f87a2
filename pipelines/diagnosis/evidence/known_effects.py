"""Choose the effects that a machine is known to have, as part of its baseline.

The builder of a machine knows its rotors and gears. Data need not show that they are present, only
how large they are.
"""

from collections.abc import Sequence

from pipelines.effects import Effect, Side
from pipelines.mechanics.machine import Machine
from pipelines.model import BASELINE
from pipelines.wording.label import effect_at


def known_effects(labels: Sequence[str], machine: Machine) -> tuple[Effect, ...]:
    """Return the effects of some labels, such as ``rotor_inertia@knee``, at a machine.

    Raises
    ------
    InputError
        Where no effect has this name or is at this joint, or drawings do not show it.
    """
    return tuple(
        effect_at(label, machine, _fits, "diagnose.known") for label in dict.fromkeys(labels)
    )


def _fits(effect: type[Effect]) -> bool:
    """Return whether drawings show an effect, and all its parameters are linear.

    Drawings show inertias, springs and masses, but no friction.
    """
    shown = effect.inertial or effect.side is Side.STRUCTURE
    return shown and effect.name not in BASELINE and bool(effect.linear) and not effect.shape
