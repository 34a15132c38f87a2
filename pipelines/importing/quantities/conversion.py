"""A column as a quantity in SI: sign bit, wraps, scale, zero, unit, drive train, sign."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Note, counted
from pipelines.importing.quantities.expression import Expression
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING, have_minutes, numbers
from pipelines.importing.quantities.wraparound import (
    full_at,
    note_guessed_turns,
    sawtooth,
    sign_bit,
    signed,
    unwrapped,
    with_sign_bit,
)
from pipelines.settings.import_map import ReadingSettings
from pipelines.settings.units import UNITS, Unit


def columns_of(reading: ReadingSettings, where: str) -> tuple[str, ...]:
    """Return the columns that a reading is computed from, without its clock."""
    if reading.column is not None:
        return (reading.column,)
    return Expression(str(reading.expression), f"{where}.expression").names


def quantity(
    reading: ReadingSettings,
    gain: float,
    columns: Mapping[str, NDArray],
    where: str,
    note: Note,
    time_s: NDArray,
    *,
    turns: bool = False,
) -> NDArray:
    """Return a reading as a quantity: sign x gain x unit(scale x raw - zero).

    Parameters
    ----------
    reading : ReadingSettings
        Columns, unit and corrections from the map.
    gain : float
        Gain of the drive train: counts per turn, gear ratio, torque constant.
    columns : mapping of str to (n,) array
        Columns of the log.
    where : str
        Name of the quantity in errors.
    note : callable
        Takes what is reported about the reading.
    time_s : (n,) array
        Times of the rows, s, NaN where missing.
    turns : bool, optional
        Whether it is the angle of a joint that turns without end, and is unwrapped in any case.

    Returns
    -------
    (n,) array
        The quantity in SI, NaN where the log has none.
    """
    raw = _raw(reading, columns, where, note)
    if reading.signed_bits is not None:
        raw = signed(raw, reading.signed_bits, note)
    if reading.sign_bit is not None:
        raw = with_sign_bit(raw, reading.sign_bit, note)
    elif reading.signed_bits is None and (bit := sign_bit(raw)) is not None:
        seen = f"jumps by 2^{bit} between small numbers, as a magnitude with a sign bit does"
        note(seen, f"kept; set sign_bit = {bit} if that is so")
    # After the sign, as limits are of signed readings. Before unwrapping, because an impossible
    # reading would count as a wraparound.
    if reading.range is not None:
        raw = _within(raw, reading.range, note)
    # An infinite value, as of an expression that divides by zero, is as little known as none.
    raw = np.where(np.isinf(raw), np.nan, raw)
    unit, wraps_at = reading.known_unit, reading.wraps_at
    if unit == UNITS["deg"] and have_minutes(raw):
        seen = "decimals never reach .60, as minutes and seconds after a point do"
        note(seen, "read as decimals of a degree; write decimal degrees to the log if they are not")
    if wraps_at is None:
        full = full_at(raw, _turns(reading, unit))
        if turns:
            wraps_at = full or sawtooth(raw, _turns(reading, unit))
        # Only reported: a step by a turn may be meant, as in a set-point.
        elif full is not None:
            seen = f"steps by {full:.6g} from one row to the next, as a full counter does"
            note(seen, f"kept; set wraps_at = {full:.10g} at it")
    if wraps_at is not None:
        # The joint's zero as a raw reading: most joints begin less than half a turn from it.
        near = reading.zero / reading.scale if reading.begins_at is None else reading.begins_at
        raw = unwrapped(raw, wraps_at, note, near)
        note_guessed_turns(time_s, raw, wraps_at, note)
    return reading.sign * gain * (unit.factor * (reading.scale * raw - reading.zero) + unit.offset)


def _turns(reading: ReadingSettings, unit: Unit) -> tuple[float, ...]:
    """Return the raw reading of a full turn of an encoder; nothing for other quantities."""
    counts = getattr(reading, "counts_per_turn", None) if unit.dimension == "counts" else None
    turn = 2.0 * np.pi / unit.factor if unit.dimension == "angle" else counts
    return () if turn is None else (abs(turn / reading.scale),)


def _raw(
    reading: ReadingSettings, columns: Mapping[str, NDArray], where: str, note: Note
) -> NDArray:
    if reading.column is not None:
        return numbers(columns[reading.column], note)
    expression = Expression(str(reading.expression), f"{where}.expression")
    return expression({name: numbers(columns[name], note) for name in expression.names})


def _within(raw: NDArray, limits: tuple[float, float], note: Note) -> NDArray:
    outside = (raw < limits[0]) | (raw > limits[1])
    if outside.any():
        seen = f"{counted(int(outside.sum()), 'row')} outside {limits[0]:g} … {limits[1]:g}"
        note(seen, TAKEN_FOR_MISSING)
    return np.where(outside, np.nan, raw)
