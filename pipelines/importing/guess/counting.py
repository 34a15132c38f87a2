"""How a joint's columns were counted: in registers that lost their sign, or that start anew when
they are full."""

from collections.abc import Mapping
from dataclasses import dataclass

from numpy.typing import NDArray

from pipelines.importing.guess.joints import JointColumns
from pipelines.importing.guess.motion import TURNS
from pipelines.importing.guess.register import lost_sign
from pipelines.importing.quantities.wraparound import full_at, signed, unwrapped


@dataclass(frozen=True)
class Counting:
    """How a column was counted; nothing of what simply holds its numbers."""

    bits: int | None = None
    """Of a signed register that was logged as if it had no sign."""
    full: float | None = None
    """Reading at which it starts anew."""

    def undone(self, values: NDArray) -> NDArray:
        """Return what was counted, (n,), in readings that go on."""
        values = values.astype(float)
        if self.bits is not None:
            values = signed(values, self.bits, "", [])
        return values if self.full is None else unwrapped(values, self.full, "", [])


def countings(joint: JointColumns, columns: Mapping[str, NDArray]) -> dict[str, Counting]:
    """Return how each quantity of a joint was counted, from a log's columns (n,)."""
    logged = {quantity: columns[m.column].astype(float) for quantity, m in joint.columns.items()}
    found = {quantity: Counting(lost_sign(values)) for quantity, values in logged.items()}
    unit = joint.columns["angle"].unit
    turns = [turn for name, turn in TURNS.items() if unit in (None, name)]
    full = full_at(found["angle"].undone(logged["angle"]), turns)
    if full is None:
        return found
    found["angle"] = Counting(found["angle"].bits, full)
    # A set-point may step by a turn, and so be told to; it starts anew only where the angle does.
    if (
        "reference" in found
        and full_at(found["reference"].undone(logged["reference"]), turns) == full
    ):
        found["reference"] = Counting(found["reference"].bits, full)
    return found
