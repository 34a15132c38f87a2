"""Columns of nested content, with plain names: ``hip.position``, ``q[0]``."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.importing.sources.source import Columns, Source

Leaves = dict[str, np.ndarray]
"""Arrays of any shape in nested content, by their path."""
LABELS = ("name", "label", "title", "signalname", "blockname")
"""Fields of a record that name its signal, in lower case."""


def nested_source(
    path: Path, format: str, leaves: Leaves, notes: tuple[str, ...] = (), **more: Any
) -> Source:
    """Return a log of the arrays in nested content.

    Time runs along the axis that is as long as a vector (n,) in the content, or else the longest.
    """
    lengths = vector_lengths(array.shape for array in leaves.values())
    columns = {
        column: values
        for name, array in leaves.items()
        for column, values in columns_of(array, name, lengths).items()
    }
    notes = (*notes, *turned({name: a.shape for name, a in leaves.items()}, lengths))
    return Source.in_memory(path, format, columns, notes=notes, clocks=clocks_of(columns), **more)


def clocks_of(columns: Mapping[str, np.ndarray], separator: str = ".") -> dict[str, str]:
    """Return the clock (n,) in the same table as each column, where several tables have one."""
    words = ("time", "t", "timestamp", "timestamps")
    clocks = {
        name.rpartition(separator)[0]: name
        for name, values in columns.items()
        if name.rpartition(separator)[2].casefold() in words and len(values) > 1
    }
    owners = {name: clocks.get(name.rpartition(separator)[0], name) for name in columns}
    return {
        name: clock
        for name, clock in owners.items()
        if len(clocks) > 1 and clock != name and len(columns[clock]) == len(columns[name])
    }


def leaves_of(content: Any, name: str = "") -> Leaves:
    """Return every array (n, ...) of numbers or text in nested content; others are left out."""
    return dict(_leaves(content, name))


def places_of(content: Any, name: str = "") -> dict[str, str]:
    """Return the names of signals by their places in a list of records, and by their own names.

    ``Y.Data[0]`` is the Data of the first record in Y, whose column has the record's name.
    """
    places: dict[str, str] = {}
    if isinstance(content, Mapping):
        for key, value in content.items():
            places |= places_of(value, f"{name}.{key}" if name else str(key))
    elif is_list_of_records(content) and _are_signals(content):
        labels = [_label(record) for record in content]
        arrays = [[key for key, one in record.items() if _longest(one) > 1] for record in content]
        if _are_names(labels) and all(len(keys) == 1 for keys in arrays):
            for k, (label, (key,)) in enumerate(zip(labels, arrays, strict=True)):
                places[f"{name}.{key}[{k}]"] = f"{name}.{label}"
    return places


def vector_lengths(shapes: Iterable[tuple[int, ...]]) -> frozenset[int]:
    """Return the lengths of vectors among arrays of these shapes."""
    return frozenset(max(shape) for shape in shapes if shape and _is_vector(shape))


def columns_of(array: np.ndarray, name: str, lengths: Collection[int]) -> Columns:
    """Return the columns of an array that may have several, (n,) each.

    Parameters
    ----------
    array : array
        Samples along any axis; fields of a structured array are columns of their own.
    name : str
        Its path.
    lengths : collection of int
        Lengths of vectors in the same content, one of which may be the clock.
    """
    if array.dtype.names:
        return {
            column: values
            for part in array.dtype.names
            for column, values in columns_of(
                array[part], f"{name}.{part}" if name else part, lengths
            ).items()
        }
    if array.dtype.kind not in "biufOUSmM":
        return {}
    # A vector in any orientation: MATLAB's are matrices with one row or one column.
    if _is_vector(array.shape):
        return {name: array.reshape(-1)}
    axis = _time_axis(array.shape, lengths)
    flat = np.moveaxis(array, axis, 0).reshape(array.shape[axis], -1)
    return {f"{name}[{k}]": flat[:, k] for k in range(prod(flat.shape[1:]))}


def turned(shapes: Mapping[str, tuple[int, ...]], lengths: Collection[int]) -> list[str]:
    """Return a note on the arrays whose samples lie along another axis than the first."""
    names = [
        f"{name} ({' x '.join(map(str, shape))})"
        for name, shape in shapes.items()
        if not _is_vector(shape) and _time_axis(shape, lengths)
    ]
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return [f"time along the longer side of {', '.join(names[:5])}{more}"] if names else []


def _is_vector(shape: tuple[int, ...]) -> bool:
    return max(shape, default=1) == prod(shape)


def _time_axis(shape: tuple[int, ...], lengths: Collection[int]) -> int:
    """Return the axis of time: as long as a vector in the content, or else the longest."""
    axes = [axis for axis, length in enumerate(shape) if length in lengths]
    return max(axes or range(len(shape)), key=lambda axis: shape[axis])


def _leaves(content: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _leaves(value, f"{name}.{key}" if name else str(key))
    elif is_list_of_records(content):
        parts = _signals(content) if _are_signals(content) else _transposed(content)
        for key, values in parts.items():
            yield from _leaves(values, f"{name}.{key}" if name else str(key))
    elif isinstance(content, Sequence | np.ndarray | int | float | str) or content is None:
        yield name, _array(content)


def is_list_of_records(content: Any) -> bool:
    """Return whether content is a list of records, one at least."""
    return (
        isinstance(content, list)
        and bool(content)
        and all(isinstance(row, Mapping) for row in content)
    )


def _are_signals(records: Sequence[Mapping]) -> bool:
    """Return whether each record holds a whole signal, not the values of one instant."""
    return all(_longest(record) > len(records) for record in (records[0], records[-1]))


def _longest(content: Any) -> int:
    """Return the greatest length of an array of numbers in nested content."""
    if isinstance(content, Mapping):
        return max(map(_longest, content.values()), default=0)
    if isinstance(content, np.ndarray):
        return max(content.shape, default=1) if content.dtype.kind in "biuf" else 0
    return len(content) if isinstance(content, list) and not is_list_of_records(content) else 0


def _signals(records: Sequence[Mapping]) -> dict[str, Any]:
    """Return the signals of records by their names, or by their places where names are no help."""
    for label in LABELS:
        keys = [next((key for key in one if key.lower() == label), None) for one in records]
        names = [one[key] if key else "" for key, one in zip(keys, records, strict=True)]
        if all(isinstance(n, str) and n for n in names) and len(set(names)) == len(names):
            rest = [
                {other: value for other, value in one.items() if other != key}
                for key, one in zip(keys, records, strict=True)
            ]
            return {n: _only_array(one) for n, one in zip(names, rest, strict=True)}
    return {str(k): _only_array(record) for k, record in enumerate(records)}


def _only_array(record: Mapping) -> Any:
    """Return the array of a record that has one and no tables; else the record."""
    arrays = [value for value in record.values() if _longest(value) > 1]
    nested = any(isinstance(value, Mapping) for value in record.values())
    return arrays[0] if len(arrays) == 1 and not nested else record


def _transposed(records: Sequence[Mapping]) -> dict[str, list]:
    """Return a list of values for each key; a record without the key has no value there."""
    records = _by_their_names(records)
    keys = dict.fromkeys(key for record in records for key in record)
    columns = {key: [record.get(key) for record in records] for key in keys}
    return {key: _filled(values) for key, values in columns.items()}


def _by_their_names(records: Sequence[Mapping]) -> list[Mapping]:
    """Return rows whose parts have names, not places, as a logger may change their order.

    A part is a record with a name in a list, as one of each joint. Where the names in a list
    change their order between rows, it is also an element of the lists next to them.
    """
    parts = {key: [record.get(key) for record in records] for key in records[0]}
    named = {key for key, values in parts.items() if all(map(_have_names, values))}
    lists = {k: v for k, v in parts.items() if k.lower() in LABELS and all(map(_are_names, v))}
    reordered = {key for key, values in lists.items() if len({str(names) for names in values}) > 1}
    if not named | reordered:
        return list(records)
    return [
        {
            column: value
            for key, values in record.items()
            for column, value in _without_places(record, key, values, named, reordered)
        }
        for record in records
    ]


def _without_places(
    record: Mapping, key: str, values: Any, named: Collection[str], reordered: Collection[str]
) -> Iterator[tuple[str, Any]]:
    """Yield the parts of a row's value by their names, where it has named parts."""
    if key in named:
        yield key, _signals(values)
        return
    names = next((record[name] for name in reordered if _is_as_long(values, record[name])), None)
    if key in reordered:
        return
    yield key, values if names is None else dict(zip(names, values, strict=True))


def _have_names(values: Any) -> bool:
    return is_list_of_records(values) and _are_names([_label(record) for record in values])


def _label(record: Mapping) -> Any:
    return next((value for key, value in record.items() if key.lower() in LABELS), None)


def _are_names(values: Any) -> bool:
    """Return whether values are a list of different names."""
    return (
        isinstance(values, list)
        and bool(values)
        and all(isinstance(name, str) and name for name in values)
        and len(set(values)) == len(values)
    )


def _is_as_long(values: Any, names: Sequence[str]) -> bool:
    return isinstance(values, list) and len(values) == len(names)


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
