"""Columns of nested content, with plain names: ``hip.position``, ``q[0]``."""

from collections.abc import Iterator, Mapping, Sequence
from math import prod
from typing import Any

import numpy as np

from pipelines.importing.sources.source import Columns


def flattened(content: Any, name: str = "") -> Columns:
    """Return every array (n,) of numbers or text in nested content; other values are left out."""
    return dict(_columns(content, name))


def _columns(content: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _columns(value, f"{name}.{key}" if name else str(key))
    elif is_list_of_records(content):
        for key, values in _transposed(content).items():
            yield from _columns(values, f"{name}.{key}" if name else str(key))
    elif isinstance(content, Sequence | np.ndarray | int | float | str) or content is None:
        yield from _numbered(_array(content), name)


def is_list_of_records(content: Any) -> bool:
    """Return whether content is a list of records, one at least."""
    return (
        isinstance(content, list)
        and bool(content)
        and all(isinstance(row, Mapping) for row in content)
    )


def _transposed(records: Sequence[Mapping]) -> dict[str, list]:
    """Return a list of values for each key; a record without the key has no value there."""
    keys = dict.fromkeys(key for record in records for key in record)
    columns = {key: [record.get(key) for record in records] for key in keys}
    return {key: _filled(values) for key, values in columns.items()}


def _filled(values: list) -> list:
    """Replace missing records and lists by empty ones, so that all columns have as many rows."""
    whole = next((value for value in values if isinstance(value, Mapping | list)), None)
    if whole is None:
        return values
    empty: Any = {} if isinstance(whole, Mapping) else [None] * len(whole)
    return [empty if value is None else value for value in values]


def _array(content: Any) -> np.ndarray:
    try:
        # Objects are numbers with missing values among them, or text.
        array = np.atleast_1d(np.asarray(content))
        return array.astype(float) if array.dtype == object else array
    except (ValueError, TypeError):  # text among numbers, or rows of different lengths
        return np.atleast_1d(np.asarray([str(value) for value in content], dtype=object))


def _numbered(array: np.ndarray, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the columns of an array that may have several; a row vector is a column."""
    if array.dtype.names:
        for field in array.dtype.names:
            yield from _numbered(array[field], f"{name}.{field}" if name else field)
        return
    if array.dtype.kind not in "biufOUS":
        return
    # A vector in any orientation: MATLAB's are matrices with one row or one column.
    if max(array.shape) == array.size:
        yield name, array.reshape(-1)
        return
    flat = array.reshape(len(array), prod(array.shape[1:]))
    for k in range(flat.shape[1]):
        yield f"{name}[{k}]", flat[:, k]
