"""What becomes of a term in a format of bodies and joints."""

from collections.abc import Callable, Mapping

from pipelines.export.exported import shift_of
from pipelines.export.format import Holding, approximate, exact, left_out
from pipelines.model import Term


def sound_friction(term: Term) -> tuple[float, float]:
    """Return Coulomb and viscous friction of a term, 0 in place of a negative one: simulators
    refuse what drives."""
    coulomb, viscous = (max(float(value), 0.0) for value in term.values)
    return coulomb, viscous


def held_friction(term: Term, whole: Holding) -> Holding:
    """Return ``whole`` where both halves of a friction can be held, else which of them is not."""
    negative = [
        p.name for p, value in zip(term.effect.parameters, term.values, strict=True) if value < 0.0
    ]
    if not negative:
        return whole
    why = f"its {' and '.join(negative)} friction is negative, which would drive the joint"
    return left_out(why) if len(negative) == 2 else approximate(f"its other half alone: {why}")


Held = Mapping[str, Callable[[Term], Holding]]
"""What becomes of a term, by its effect's name."""


def looked_up(held: Held, shift: str, format_name: str) -> Callable[[Term], Holding]:
    """Return what tells the holding of a term in a format of bodies and joints; encoders' shifts
    are ``shift``."""

    def holding(term: Term) -> Holding:
        if shift_of(term) is not None:
            return exact(shift)
        held_as = held.get(term.effect.name)
        return held_as(term) if held_as else left_out(f"{format_name} has no element for it")

    return holding
