"""Logs in HDF5, including MATLAB v7.3."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.errors import InputError
from pipelines.importing.sources.extra import library
from pipelines.importing.sources.flatten import clocks_of, columns_of, turned, vector_lengths
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings

MATLAB_CLASSES_OF_NUMBERS = frozenset(
    b"double single logical int8 int16 int32 int64 uint8 uint16 uint32 uint64".split()
)


def open_hdf5(path: Path, settings: SourceSettings, format: str = "HDF5") -> Source:
    """Return the log in an HDF5 file; names have slashes, as in ``run1/hip/angle``.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    h5py = library("h5py")
    try:
        with h5py.File(path) as file:
            group = _group(file, settings.table)
            empty = {data: _values(group[data], sample=True) for data in _data_sets(group)}
            lengths = vector_lengths(array.shape for array in empty.values())
            parts = {data: columns_of(array, data, lengths) for data, array in empty.items()}
            columns = {name: data for data, part in parts.items() for name in part}
            clocks = clocks_of({k: v for part in parts.values() for k, v in part.items()}, "/")
            packed = [data for data in empty if _packing(group[data]) is not None]
    except OSError as error:
        raise InputError(f"is a damaged or truncated HDF5 file ({error}); copy it again") from error

    def load(names: Sequence[str]) -> Columns:
        with h5py.File(path) as file:
            group = _group(file, settings.table)
            wanted = dict.fromkeys(columns[name] for name in names)
            values_of = {
                name: values
                for data in wanted
                for name, values in columns_of(_values(group[data]), data, lengths).items()
            }
        return {name: values_of[name] for name in names}

    notes = turned({data: array.shape for data, array in empty.items()}, lengths)
    # Printed, since a map that scales such a column by itself would scale it twice.
    more = f" and {len(packed) - 5} more" if len(packed) > 5 else ""
    remark = (
        f"{', '.join(packed[:5])}{more}: unpacked by scale_factor and add_offset of the file; the"
        " map's scale and zero are of the unpacked values"
    )
    return Source(
        path,
        format,
        tuple(columns),
        load,
        tuple(notes),
        clocks=clocks,
        remarks=(remark,) if packed else (),
    )


def _group(file: Any, table: str | None) -> Any:
    if table is None:
        return file
    if table not in file:
        raise InputError(
            f"has no group {table!r}, which source.table names; it has {', '.join(file)}"
        )
    if not hasattr(file[table], "visititems"):
        raise InputError(
            f"source.table names {table!r}, which is a data set, expected a group; remove"
            " source.table and name the data set as a column"
        )
    return file[table]


def _data_sets(group: Any) -> list[str]:
    """Return the names of all data sets with numbers below a group, in the file's order."""
    names: list[str] = []

    def visit(name: str, item: Any) -> None:
        # MATLAB keeps the content of its cells below #refs#, under meaningless names.
        if hasattr(item, "dtype") and not name.startswith("#") and _is_of_numbers(item):
            names.append(name)

    group.visititems(visit)
    return names


def _is_of_numbers(data: Any) -> bool:
    matlab = data.attrs.get("MATLAB_class")
    return _has_numbers(data.dtype) and (matlab is None or matlab in MATLAB_CLASSES_OF_NUMBERS)


def _has_numbers(kind: np.dtype) -> bool:
    """Return whether a type, or a part of a record, is of numbers; others make no column."""
    kind = kind.base
    if kind.names:
        return any(_has_numbers(kind[field]) for field in kind.names)
    return kind.kind in "biuf"


def _values(data: Any, sample: bool = False) -> np.ndarray:
    """Return a data set's values, a few rows for a sample; axes of MATLAB's are transposed."""
    if "MATLAB_class" in data.attrs and data.ndim > 1:
        return data[()].T if not sample else np.empty(data.shape[::-1], dtype=data.dtype)
    # Names follow from shape and type, so a sample needs no values; an empty array costs nothing.
    values = np.empty(data.shape, dtype=data.dtype) if sample else data[()]
    packing = _packing(data)
    return np.atleast_1d(values if packing is None else _unpacked(values, data, *packing))


def _packing(data: Any) -> tuple[float, float] | None:
    """Return the factor and the offset of packed numbers, by the CF conventions of netCDF."""
    factor, offset = (
        _number(data.attrs.get(name, default))
        for name, default in (("scale_factor", 1.0), ("add_offset", 0.0))
    )
    if factor is None or offset is None or data.dtype.kind not in "iuf":
        return None
    return None if (factor, offset) == (1.0, 0.0) else (factor, offset)


def _unpacked(values: np.ndarray, data: Any, factor: float, offset: float) -> np.ndarray:
    """Return numbers as they were before they were packed; NaN where the file has none."""
    result = values * factor + offset
    for name in ("_FillValue", "missing_value"):
        if name in data.attrs:
            result[np.isin(values, data.attrs[name])] = np.nan
    return result


def _number(value: Any) -> float | None:
    """Return the one number of an attribute; None if it has none."""
    array = np.asarray(value)
    return float(array.reshape(-1)[0]) if array.size == 1 and array.dtype.kind in "iuf" else None
