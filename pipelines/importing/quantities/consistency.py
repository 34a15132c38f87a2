"""Whether the columns of a log agree: velocity integrates to angle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SPAN = 20
"""Samples over which a velocity is integrated: long against noise, short against drift."""
MOST = 200_000
"""Greatest number of rows that are compared, from the middle of the log."""


@dataclass(frozen=True)
class Agreement:
    """How one column follows from another: slope and the share of the variance that it explains."""

    slope: float
    explained: float


def integral_agreement(time_s: NDArray, angle: NDArray, velocity: NDArray) -> Agreement | None:
    """Compare the steps of an angle with the integral of a velocity over them.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    angle, velocity : (n,) array
        Columns in any units, NaN where missing.

    Returns
    -------
    Agreement or None
        Its slope is the velocity's integral per unit of angle: 1 where units and signs agree, -1
        where signs differ. None where nothing moves, or the log is too short.
    """
    time_s, angle, velocity = whole_rows(time_s, angle, velocity)
    # Neighbouring spans overlap. Fewer than five spans end to end agree by chance.
    if len(time_s) < 5 * SPAN:
        return None
    # Steps over a span need no constant of integration. A bias of the velocity cannot add up over
    # the whole log, either.
    x, y = angle[SPAN:] - angle[:-SPAN], _travel(time_s, velocity)
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx == 0.0 or yy == 0.0 or xy == 0.0:
        return None
    # The geometric mean of both regressions, as both columns have noise: a regression of y on x
    # alone would understate the slope.
    return Agreement(float(np.sign(xy)) * np.sqrt(yy / xx), xy**2 / (xx * yy))


def likeliest_integrals(
    time_s: NDArray, angles: Sequence[NDArray], velocities: Sequence[NDArray]
) -> list[tuple[int, int]]:
    """Return the pairs of many angles and velocities that may agree (`integral_agreement`).

    All pairs are compared at once, at fewer instants, with missing values interpolated. The pairs
    returned are candidates, to be compared one by one.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    angles, velocities : sequence of (n,) array
        Columns in any units, NaN where missing.

    Returns
    -------
    list of (int, int)
        Indices of the angle and the velocity of each pair.
    """
    # Greatest number of values, of all columns together, by which all pairs are compared.
    most_screened = 2_000_000
    # Rows of each column that are compared at least.
    fewest_screened = 1_000
    # Greatest number of candidate pairs.
    most_likely = 100
    time_s, *columns = _middle(time_s, *angles, *velocities)
    if len(time_s) < 5 * SPAN or not angles or not velocities:
        return []
    # Two minus signs round the stride up: at most so many rows of each column remain.
    some = slice(None, None, -(-len(time_s) // max(fewest_screened, most_screened // len(columns))))
    whole = [_interpolated(column) for column in columns]
    # Rows of length one: their products are cosines, whose squares are shares of variance.
    steps = _unit_rows([(angle[SPAN:] - angle[:-SPAN])[some] for angle in whole[: len(angles)]])
    travels = _unit_rows([_travel(time_s, velocity)[some] for velocity in whole[len(angles) :]])
    likely: list[tuple[float, int, int]] = []
    # A block of the angles at a time: thousands of columns have millions of pairs.
    block = 256
    for first in range(0, len(steps), block):
        # A velocity cannot integrate to the negative angle.
        shares = np.square(np.maximum(steps[first : first + block] @ travels.T, 0.0))
        best = np.argsort(shares, axis=None)[-most_likely:]
        # Candidates explain more than half of the variance.
        rows, others = np.unravel_index(best[shares.flat[best] > 0.5], shares.shape)
        candidates = (
            (float(shares[i, j]), first + int(i), int(j)) for i, j in zip(rows, others, strict=True)
        )
        likely = sorted([*likely, *candidates], reverse=True)[:most_likely]
    return sorted((angle, velocity) for _, angle, velocity in likely)


def _interpolated(values: NDArray) -> NDArray:
    """Return values (n,) with missing ones interpolated; zeros where fewer than two are known."""
    known = np.isfinite(values)
    # A column that moves somewhere in the log may have no number in its middle.
    if np.count_nonzero(known) < 2:
        return np.zeros_like(values)
    if known.all():
        return values
    return np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])


def _unit_rows(rows: Sequence[NDArray]) -> NDArray:
    """Return vectors (n,) as rows of a matrix, each scaled to length one unless it is zero."""
    matrix = np.array(rows)
    lengths = np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.divide(matrix, lengths, out=np.zeros_like(matrix), where=lengths > 0.0)


def _travel(time_s: NDArray, velocity: NDArray) -> NDArray:
    """Return the integral of a velocity (n,) over each span of samples, (n - SPAN,)."""
    travel = np.concatenate(
        [[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s))]
    )
    return travel[SPAN:] - travel[:-SPAN]


def whole_rows(*columns: NDArray) -> list[NDArray]:
    """Return the rows in which each column has a number, from the middle of the log.

    Parameters
    ----------
    *columns : (n,) arrays
        Columns of one log.

    Returns
    -------
    list of (m,) arrays
        The same columns.
    """
    columns = _middle(*columns)
    known = np.all([np.isfinite(column) for column in columns], axis=0)
    return [column[known] for column in columns]


def _middle(*columns: NDArray) -> tuple[NDArray, ...]:
    # The middle, as machines often stand still at both ends of a log.
    middle = slice(max(0, (len(columns[0]) - MOST) // 2), (len(columns[0]) + MOST) // 2)
    return tuple(column[middle] for column in columns)
