"""What becomes of a term in a format of bodies and joints."""

from collections.abc import Callable, Mapping

from pipelines.export.exported import shift_of
from pipelines.export.format import Holding, exact, left_out
from pipelines.model import Term

Held = Mapping[str, Callable[[Term], Holding]]
"""What becomes of a term, by its effect's name."""


def looked_up(held: Held, shift: str, format_name: str) -> Callable[[Term], Holding]:
    """Return what tells the holding of a term in a format of bodies and joints; encoders' shifts are ``shift``."""

    def holding(term: Term) -> Holding:
        if shift_of(term) is not None:
            return exact(shift)
        found = held.get(term.effect.name)
        return found(term) if found else left_out(f"{format_name} has no element for it")

    return holding
