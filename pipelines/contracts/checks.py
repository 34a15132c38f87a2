"""Checks of a column's values; each error names column, first bad row (from 0) and remedy."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa
import pyarrow.compute as pc

from pipelines.errors import ContractError

LARGEST_ANGLE_RAD = 3 * math.pi
"""Largest angle in radians, 1.5 turns; a hip's swing of 20 degrees would exceed it as 20 rad."""


@dataclass(frozen=True)
class Place:
    """A column of a source, from a row on, as messages name it."""

    source: str
    column: str
    first_row: int = 0

    def __str__(self) -> str:
        return f"{self.source}: column {self.column}"

    def row(self, k: int) -> str:
        """Name the place of the ``k``-th of the values."""
        return f"{self}, row {self.first_row + k}"


def convert(column: pa.ChunkedArray, dtype: pa.DataType, where: Place) -> pa.ChunkedArray:
    """Convert a column to the contract's type without loss.

    Other tools write float32, integers, decimals or large strings where the contract has float64,
    int64 or string. A number of any width is accepted as long as its value survives.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        The column as it was read.
    dtype : pyarrow.DataType
        The contract's type.
    where : Place
        Its place, for the message.

    Raises
    ------
    ContractError
        The type differs in kind, or a value does not fit.
    """
    if column.type == dtype:
        return column
    actual, expected = type_name(column.type), type_name(dtype)
    if not _alike(column.type, dtype):
        raise ContractError(
            f"{where}: found type {actual}, expected {expected}; write the column as {expected}"
        )
    try:
        # Arrow's cast is safe by default: a value that would change raises an error.
        return column.cast(dtype)
    except pa.ArrowException as error:
        raise ContractError(
            f"{where}: found type {actual}, whose values {expected} cannot hold ({error}); "
            f"write the column as {expected}"
        ) from error


def type_name(dtype: pa.DataType) -> str:
    """Return an Arrow type by its name in NumPy: float64, not double."""
    # Arrow prints float32 as float, and float64 as double.
    return re.sub(r"\bfloat\b", "float32", str(dtype).replace("double", "float64"))


def _alike(actual: pa.DataType, expected: pa.DataType) -> bool:
    # A column without any value has no type of its own, and fits every one.
    if pa.types.is_null(actual):
        return True
    if pa.types.is_dictionary(actual):
        return _alike(actual.value_type, expected)
    if _is_list(actual) and _is_list(expected):
        return _alike(actual.value_type, expected.value_type)
    same_kind = (_is_number, is_text, pa.types.is_boolean, pa.types.is_struct)
    return any(is_kind(actual) and is_kind(expected) for is_kind in same_kind)


def _is_list(dtype: pa.DataType) -> bool:
    kinds = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
    return any(is_kind(dtype) for is_kind in kinds)


def _is_number(dtype: pa.DataType) -> bool:
    return pa.types.is_integer(dtype) or pa.types.is_floating(dtype) or pa.types.is_decimal(dtype)


def is_text(dtype: pa.DataType) -> bool:
    """Return whether a type is one of Arrow's for text."""
    kinds = (pa.types.is_string, pa.types.is_large_string, pa.types.is_string_view)
    return any(is_kind(dtype) for is_kind in kinds)


def refuse_missing(column: pa.ChunkedArray, nullable: bool, where: Place) -> None:
    """Refuse infinities and missing values.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        Values of any type.
    nullable : bool
        Whether missing values (null or NaN) are accepted.
    where : Place
        Its place, for the message.

    Raises
    ------
    ContractError
        Names the first row.
    """
    correct_rows = "correct or drop the row and write the file again"
    is_float = pa.types.is_floating(column.type)
    missing = pc.is_null(column, nan_is_null=True)
    if not nullable and _any(missing):
        actual, expected = "null", f"a value of type {type_name(column.type)}"
        if is_float:
            actual, expected = "NaN", "a finite number"
        raise ContractError(
            f"{where.row(first_true(missing))}: found {actual}, expected {expected}; {correct_rows}"
        )
    if is_float and _any(pc.is_inf(column)):
        row = first_true(pc.is_inf(column))
        raise ContractError(
            f"{where.row(row)}: found {column[row].as_py()}, expected a finite number;"
            f" {correct_rows}"
        )


def refuse_unknown_values(column: pa.ChunkedArray, choices: Sequence[str], where: Place) -> None:
    """Refuse text that is none of the choices.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        Text.
    choices : sequence of str
        The accepted values.
    where : Place
        Its place, for the message.

    Raises
    ------
    ContractError
        Names the first row.
    """
    # A column of choices has few different values, so rows are searched only for the message.
    unknown = [value for value in pc.unique(column).to_pylist() if value not in (None, *choices)]
    if unknown:
        row = first_true(pc.equal(column, unknown[0]))
        raise ContractError(
            f"{where.row(row)}: found {unknown[0]!r}, expected one of"
            f" {', '.join(choices)}; correct the value"
        )


def refuse_implausible(
    column: pa.ChunkedArray, unit: str, where: Place, *, turns: bool = False
) -> None:
    """Refuse numbers that no machine's quantity reaches, and angles that no leg reaches in radians.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        Numbers.
    unit : str
        Their SI unit.
    where : Place
        Its place, for the message.
    turns : bool, optional
        Whether an angle may be of any number of turns.

    Raises
    ------
    ContractError
        A number is larger than 1e12, or an angle than ``LARGEST_ANGLE_RAD``.
    """
    # Up to 1e12, in SI units, the squares of a file's rows still have a sum.
    limits = {
        1e12: ", expected at most 1e+12; correct the unit or scale of the column, or drop the row"
    }
    if unit == "rad" and not turns:
        limits[LARGEST_ANGLE_RAD] = (
            ", which looks like degrees; expected radians, multiply by pi/180"
        )
    # The two ends show whether any row is wrong; the row itself is sought only for the message.
    ends = [end for end in pc.min_max(column).as_py().values() if end is not None]
    for largest, remedy in limits.items():
        if any(abs(end) > largest for end in ends):
            row = first_true(pc.greater(pc.abs(column), largest))
            raise ContractError(f"{where.row(row)}: found {column[row].as_py():.6g}{remedy}")


def refuse_time_not_increasing(
    rows: pa.Table, time: str, restarts_with: Sequence[str], where: Place
) -> None:
    """Refuse time that does not strictly increase.

    Parameters
    ----------
    rows : pyarrow.Table
        Rows in order.
    time : str
        Column of the time, s.
    restarts_with : sequence of str
        Columns at whose changes time may restart.
    where : Place
        Its place, for the message.

    Raises
    ------
    ContractError
        Names the first row that is not later than the one before.
    """
    before, after = rows.slice(0, rows.num_rows - 1), rows.slice(1)
    wrong = pc.less_equal(after[time], before[time])
    for key in restarts_with:
        wrong = pc.and_(wrong, pc.equal(after[key], before[key]))
    if _any(wrong):
        row = first_true(wrong)
        raise ContractError(
            f"{where.row(row + 1)}: found {after[time][row].as_py()!r} after"
            f" {before[time][row].as_py()!r}, "
            "expected strictly increasing time; sort the rows and drop repeated ones"
        )


def first_true(values: pa.ChunkedArray) -> int:
    """Return the row of the first true value.

    For messages only: Arrow imports pandas, which takes long, to convert ``True``.
    """
    return int(pc.index(values, True).as_py())


def _any(values: pa.ChunkedArray) -> bool:
    return bool(pc.any(values).as_py())
