"""A column as a quantity in SI: sign bit, wraps, scale, zero, unit, drive train, sign."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.counter import signed, unwrapped
from pipelines.importing.expression import Expression
from pipelines.importing.finding import Finding, counted
from pipelines.importing.numbers import numbers
from pipelines.settings.import_map import ReadingSettings
from pipelines.settings.units import unit_named


def columns_of(reading: ReadingSettings, where: str) -> tuple[str, ...]:
    """Return the columns that a reading is made of, its clock's not among them."""
    if reading.column is not None:
        return (reading.column,)
    return Expression(str(reading.expression), f"{where}.expression").names


def quantity(
    reading: ReadingSettings, gain: float, columns: Mapping[str, NDArray], where: str, findings: list[Finding]
) -> NDArray:
    """Return the quantity (n,) in SI: sign x gain x unit(scale x raw - zero), NaN where the log has none.

    ``gain`` is the drive train's: counts per turn, gear ratio, torque constant.
    """
    raw = _raw(reading, columns, where, findings)
    if reading.signed_bits is not None:
        raw = signed(raw, reading.signed_bits, where, findings)
    if reading.range is not None:
        raw = _believed(raw, reading.range, where, findings)
    if reading.wraps_at is not None:
        raw = unwrapped(raw, reading.wraps_at, where, findings)
    unit = unit_named(reading.unit)
    assert unit is not None, "was looked at with the map"
    return reading.sign * gain * (unit.factor * (reading.scale * raw - reading.zero) + unit.offset)


def _raw(reading: ReadingSettings, columns: Mapping[str, NDArray], where: str, findings: list[Finding]) -> NDArray:
    if reading.column is not None:
        return numbers(columns[reading.column], where, findings)
    expression = Expression(str(reading.expression), f"{where}.expression")
    return expression({name: numbers(columns[name], where, findings) for name in expression.names})


def _believed(raw: NDArray, limits: tuple[float, float], where: str, findings: list[Finding]) -> NDArray:
    outside = (raw < limits[0]) | (raw > limits[1])
    if outside.any():
        seen = f"{counted(int(outside.sum()), 'row')} outside {limits[0]:g} … {limits[1]:g}"
        findings.append(Finding(where, seen, "taken for missing"))
    return np.where(outside, np.nan, raw)
