"""What the values of a column must keep; each check names column, first bad row (counted from 0)
and remedy."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from pipelines.errors import ContractError

# No joint of a leg turns one and a half times; a hip that swings through 20 degrees "reaches" 20.
LARGEST_ANGLE_RAD = 3 * np.pi
# In SI no joint, drive or sensor has as much of anything, whatever unit it was taken for; the
# squares of a file's rows still have a sum.
LARGEST = 1e12


@dataclass(frozen=True)
class Place:
    """Where values stand: in a column of a source, from a row on, as messages name it."""

    source: str
    column: str
    first_row: int = 0

    def __str__(self) -> str:
        return f"{self.source}: column {self.column}"

    def row(self, k: int) -> str:
        """Name the place of the ``k``-th of the values."""
        return f"{self}, row {self.first_row + k}"


def convert(column: pa.ChunkedArray, dtype: pa.DataType, where: Place) -> pa.ChunkedArray:
    """Return the column in the contract's type where nothing is lost by it; refuse it otherwise.

    Other tools write float32, integers, decimals or large strings where the contract has float64,
    int64 or string. Every number of any width is taken for a number as long as its value survives.
    """
    if column.type == dtype:
        return column
    found, expected = type_name(column.type), type_name(dtype)
    if not _alike(column.type, dtype):
        raise ContractError(
            f"{where}: found type {found}, expected {expected}; write the column as {expected}"
        )
    try:
        return column.cast(dtype)
    except pa.ArrowException as error:
        raise ContractError(
            f"{where}: found type {found}, whose values {expected} cannot hold ({error}); "
            f"write the column as {expected}"
        ) from error


def type_name(dtype: pa.DataType) -> str:
    """Return an Arrow type as this project and NumPy call it: float64, not double."""
    return re.sub(r"\bfloat\b", "float32", str(dtype).replace("double", "float64"))


def _alike(found: pa.DataType, expected: pa.DataType) -> bool:
    if pa.types.is_null(found):
        return True
    if pa.types.is_dictionary(found):
        return _alike(found.value_type, expected)
    if _is_list(found) and _is_list(expected):
        return _alike(found.value_type, expected.value_type)
    same_kind = (_is_number, is_text, pa.types.is_boolean, pa.types.is_struct)
    return any(is_kind(found) and is_kind(expected) for is_kind in same_kind)


def _is_list(dtype: pa.DataType) -> bool:
    return (
        pa.types.is_list(dtype)
        or pa.types.is_large_list(dtype)
        or pa.types.is_fixed_size_list(dtype)
    )


def _is_number(dtype: pa.DataType) -> bool:
    return pa.types.is_integer(dtype) or pa.types.is_floating(dtype) or pa.types.is_decimal(dtype)


def is_text(dtype: pa.DataType) -> bool:
    """Tell whether a type is one of Arrow's for text."""
    return (
        pa.types.is_string(dtype)
        or pa.types.is_large_string(dtype)
        or pa.types.is_string_view(dtype)
    )


def refuse_missing(column: pa.ChunkedArray, nullable: bool, where: Place) -> None:
    """Refuse infinities, and, unless ``nullable``, missing values (null or NaN)."""
    missing = pc.is_null(column, nan_is_null=True).to_numpy()
    if not nullable and missing.any():
        row = int(np.argmax(missing))
        number = pa.types.is_floating(column.type)
        found, expected = (
            ("NaN", "a finite number")
            if number
            else ("null", f"a value of type {type_name(column.type)}")
        )
        raise ContractError(f"{where.row(row)}: found {found}, expected {expected}; {_MEND_ROWS}")
    if pa.types.is_floating(column.type):
        infinite = np.isinf(column.to_numpy())
        if infinite.any():
            row = int(np.argmax(infinite))
            raise ContractError(
                f"{where.row(row)}: found {column[row].as_py()}, expected a finite number;"
                f" {_MEND_ROWS}"
            )


_MEND_ROWS = "mend or drop the row and write the file again"


def refuse_unknown_values(column: pa.ChunkedArray, choices: Sequence[str], where: Place) -> None:
    """Refuse text that is none of the choices."""
    strange = (
        pc.invert(pc.is_in(column, value_set=pa.array(choices))).to_numpy()
        & column.is_valid().to_numpy()
    )
    if strange.any():
        row = int(np.argmax(strange))
        raise ContractError(
            f"{where.row(row)}: found {column[row].as_py()!r}, expected one of"
            f" {', '.join(choices)}; mend the value"
        )


def refuse_absurd(column: pa.ChunkedArray, where: Place) -> None:
    """Refuse numbers that no machine's quantity reaches."""
    said = (
        f", expected at most {LARGEST:g}; correct the unit or scale of the column, or drop the row"
    )
    _refuse_beyond(LARGEST, column, where, said)


def refuse_degrees(column: pa.ChunkedArray, where: Place) -> None:
    """Refuse angles that no leg reaches in radians."""
    said = ", which looks like degrees; expected radians, multiply by pi/180"
    _refuse_beyond(LARGEST_ANGLE_RAD, column, where, said)


def _refuse_beyond(most: float, column: pa.ChunkedArray, where: Place, said: str) -> None:
    """Refuse the first number whose size is more than ``most``; ``said`` comes after what was
    found."""
    size = np.nan_to_num(np.abs(column.to_numpy()))
    row = int(np.argmax(size > most))
    if size[row] > most:
        raise ContractError(f"{where.row(row)}: found {column[row].as_py():.6g}{said}")


def refuse_time_that_does_not_increase(
    frame: pd.DataFrame, time: str, within: Sequence[str], where: Place
) -> None:
    """Refuse time that stands still or goes back; it may start anew where a column of ``within``
    changes."""
    seconds = frame[time].to_numpy()
    stands = np.diff(seconds) <= 0.0
    for key in within:
        values = frame[key].to_numpy()
        stands &= values[1:] == values[:-1]
    if stands.any():
        row = int(np.argmax(stands)) + 1
        raise ContractError(
            f"{where.row(row)}: found {float(seconds[row])!r} after {float(seconds[row - 1])!r}, "
            "expected strictly increasing time; sort the rows and drop repeated ones"
        )
