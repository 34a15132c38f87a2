"""What a machine is known to have besides its rigid body and friction: part of what everything is held against.

Who built a machine knows its rotors and gears. Data need not show that they are there, only how large they are.
"""

from collections.abc import Sequence

from pipelines.diagnosis.candidates import BASELINE
from pipelines.effects import EFFECTS, Effect, Side
from pipelines.errors import InputError
from pipelines.label import effect_labelled
from pipelines.mechanics.machine import Machine


def known_effects(labels: Sequence[str], machine: Machine) -> tuple[Effect, ...]:
    """Return the effects of some labels, ``rotor_inertia@knee``, at a machine.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or drawings do not show it.
    """
    return tuple(_known(label, machine) for label in dict.fromkeys(labels))


def _known(label: str, machine: Machine) -> Effect:
    told = effect_labelled(label)
    if _fits(type(told)) and told.joint in told.possible(machine):
        return type(told)(joint=told.joint, on=machine)
    can_be = [one(joint=place, on=machine).label for one in EFFECTS if _fits(one) for place in one.possible(machine)]
    raise InputError(
        f"diagnose.known: found {label}, expected {' or '.join(can_be) or 'nothing'}; correct it or leave it out"
    )


def _fits(effect: type[Effect]) -> bool:
    """Tell whether drawings show an effect, as an inertia, a spring or a mass, and only its linear parameters are open.

    How a joint rubs is on no drawing.
    """
    shown = effect.inertial or effect.side is Side.STRUCTURE
    return shown and effect.name not in BASELINE and bool(effect.linear) and not effect.shape
