"""How formats of bodies and joints hold the terms of a model."""

from collections.abc import Callable, Mapping

from pipelines.effects import Element
from pipelines.export.exported import shift_of
from pipelines.export.format import Holding, approximate, exact, left_out
from pipelines.model import Term


def held_friction(term: Term, whole: Holding) -> Holding:
    """Return ``whole`` if no coefficient is negative, else a holding that names the others."""
    negative = [
        p.name for p, value in zip(term.effect.parameters, term.values, strict=True) if value < 0.0
    ]
    if not negative:
        return whole
    reason = f"its {' and '.join(negative)} friction is negative and drives the joint"
    # Two negative coefficients leave nothing that a simulator accepts.
    if len(negative) == 2:
        return left_out(reason)
    return approximate(f"its other coefficient only: {reason}")


def holding_from(
    exactly: Mapping[Element | None, str],
    friction: Callable[[Term], Holding],
    shift: str,
    format_name: str,
) -> Callable[[Term], Holding]:
    """Return the function from a term to its holding.

    Parameters
    ----------
    exactly : mapping
        Place in the file, by the element that it holds exactly.
    friction : callable
        Returns the holding of friction.
    shift : str
        How the format holds an encoder's shift.
    format_name : str
        For the reason of a term that is left out.
    """

    def holding(term: Term) -> Holding:
        if shift_of(term) is not None:
            return exact(shift)
        element = term.effect.element
        if element is Element.FRICTION:
            return friction(term)
        if element in exactly:
            return exact(exactly[element])
        return left_out(f"{format_name} has no element for it")

    return holding
