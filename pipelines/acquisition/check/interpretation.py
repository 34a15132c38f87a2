"""Other interpretations of a register: its values with another type, order, unit or scale."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import get_args

from numpy.typing import NDArray

from pipelines.acquisition.check.probe import Series
from pipelines.acquisition.encodings import written_keys
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register
from pipelines.settings.rig.register import DIGITS, DIMENSION, REGISTERS, RegisterType

# Many manuals do not name the order of words, so a wrong one is likelier than a wrong type. Decimal
# digits are rare.
_COST = {"word_order": 1, "type": 2, "encoding": 3}


@dataclass(frozen=True)
class Interpretation:
    """Another description of a register."""

    register: Register
    bytes_swapped: bool
    change: str
    """The changes of the rig file, as they are written there."""
    cost: int
    """Number of errors that it assumes in the rig file, weighted by how unlikely they are."""


def _interpretations(name: str, block: Block) -> Iterator[Interpretation]:
    """Yield every description of a register; that of the rig file itself has no cost."""
    was = block.registers[name]
    others = (register for other, register in block.registers.items() if other != name)
    taken = {address for register in others for address in register.addresses}
    for kind, order, swapped in product(get_args(RegisterType), ("big", "little"), (False, True)):
        # A longer type must not reach into another register, or beyond what was read.
        end = was.address + REGISTERS[kind]
        if end > block.address + block.count or taken & set(range(was.address, end)):
            continue
        # Other types may hold no sign bit, direction or digits.
        if was.encoding_keys and kind != was.type:
            continue
        # A single word has no order.
        if REGISTERS[kind] == 1 and order != was.word_order:
            continue
        update: dict = {}
        if order != was.word_order:
            update["word_order"] = order
        if kind != was.type:
            update["type"] = kind
        cost = (
            2 * swapped
            + sum(_COST.get(key, 2) for key in update)
            + (REGISTERS[kind] != REGISTERS[was.type])
        )
        if kind.startswith("float") and not was.type.startswith("float") and was.scale != 1.0:
            update["scale"] = 1.0  # a float is in its unit, not in counts
        register = was.model_copy(update=update)
        yield Interpretation(register, swapped, _written(update, swapped), cost)
    is_plain = was.counts is not None and not was.encoding_keys
    is_binary = is_plain and name not in ("sequence", "time")
    for encoding in DIGITS if is_binary else ():
        kind = was.type if encoding == "mod10" else f"uint{was.bits}"
        update = {"encoding": encoding} | ({"type": kind} if kind != was.type else {})
        yield Interpretation(
            was.model_copy(update=update), False, _written(update, False), _COST["encoding"]
        )
    for unit in DIMENSION[name]:
        if unit != was.unit:
            register = was.model_copy(update={"unit": unit})
            yield Interpretation(register, False, _written({"unit": unit}, False), 1)


def _written(update: dict, swapped: bool) -> str:
    swap = ["the two bytes of each register swapped"] * swapped
    return " and ".join([*written_keys(update), *swap])


def remedy(
    name: str,
    unit: str,
    where: str,
    series: Series,
    plausible: Callable[[NDArray], bool],
    *,
    counts: bool = False,
) -> str | None:
    """Return in words which other description of a register is plausible; None for none.

    Parameters
    ----------
    unit : str
        SI unit of the quantity, for the text.
    where : str
        Name of the register in the rig file.
    plausible : callable
        Returns whether values (n,) are possible.
    counts : bool
        Whether the register is a counter or clock, which wraps around.
    """
    most_named = 2
    best: list[tuple[Interpretation, float]] = []
    others = [one for one in _interpretations(name, series.block) if one.cost]
    # The likeliest first.
    for one in sorted(others, key=lambda one: one.cost):
        # A costlier explanation is not named next to a likelier one.
        if best and one.cost > best[0][0].cost:
            break
        values = series.of(name, one.register, bytes_swapped=one.bytes_swapped, counts=counts)
        # Zeros are always possible, and so no evidence.
        if values.any() and plausible(values):
            best.append((one, float(values[-1])))
    if not best:
        return None
    named = ", or ".join(
        f"with {one.change} it would be {value:.4g}{unit}" for one, value in best[:most_named]
    )
    if all(one.bytes_swapped for one, _ in best[:most_named]):
        return f"{named}: Modbus sends the high byte first; set the device so, or compare {where}"
    return f"{named}: correct {where}"
