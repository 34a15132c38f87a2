"""Whether the columns of a log agree: velocity integrates to angle, torque does work."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SPAN = 20
"""Samples over which a velocity is integrated: long against the noise of an angle, short against
drift."""
MOST = 200_000
"""Rows that are looked at, from the middle of the log."""
MOST_SCREENED, FEWEST_SCREENED = 2_000_000, 1_000
"""Numbers that all columns may have together where all pairs of many are compared, and rows that
each has at least."""
BLOCK = 256
LIKELY, MOST_LIKELY = 0.5, 100
"""Share of the variance above which a pair wants a second look, and how many do at most."""


@dataclass(frozen=True)
class Agreement:
    """How one column follows from another: slope and the share of the variance that it explains."""

    slope: float
    explained: float


def integral_agreement(time_s: NDArray, angle: NDArray, velocity: NDArray) -> Agreement | None:
    """Compare steps of an angle (n,) with the integral of a velocity (n,) over them, in any units.

    ``slope`` is velocity's integral for a unit of angle: 1 where units and signs agree, -1 where
    signs differ. None where nothing moves.
    """
    time_s, angle, velocity = whole_rows(time_s, angle, velocity)
    if len(time_s) < 5 * SPAN:
        return None
    return _through_origin(angle[SPAN:] - angle[:-SPAN], _way(time_s, velocity))


def likeliest_integrals(
    time_s: NDArray, angles: Sequence[NDArray], velocities: Sequence[NDArray]
) -> list[tuple[int, int]]:
    """Return which of many angles (n,) and velocities (n,) may agree as `integral_agreement` has
    it, by their numbers.

    All are compared at once, at fewer instants and with straight lines where a column has no
    number: what is left wants a second look.
    """
    time_s, *columns = _middle(time_s, *angles, *velocities)
    if len(time_s) < 5 * SPAN:
        return []
    some = slice(None, None, -(-len(time_s) // max(FEWEST_SCREENED, MOST_SCREENED // len(columns))))
    whole = [_on_straight_lines(column) for column in columns]
    steps = _of_length_one([(angle[SPAN:] - angle[:-SPAN])[some] for angle in whole[: len(angles)]])
    ways = _of_length_one([_way(time_s, velocity)[some] for velocity in whole[len(angles) :]])
    likely: list[tuple[float, int, int]] = []
    for first in range(0, len(steps), BLOCK):  # thousands of columns have millions of pairs
        # Backwards no velocity is one.
        shares = np.square(np.maximum(steps[first : first + BLOCK] @ ways.T, 0.0))
        best = np.argsort(shares, axis=None)[-MOST_LIKELY:]
        rows, others = np.unravel_index(best[shares.flat[best] > LIKELY], shares.shape)
        found = (
            (float(shares[i, j]), first + int(i), int(j)) for i, j in zip(rows, others, strict=True)
        )
        likely = sorted([*likely, *found], reverse=True)[:MOST_LIKELY]
    return sorted((angle, velocity) for _, angle, velocity in likely)


def _on_straight_lines(values: NDArray) -> NDArray:
    """Return values (n,) with what is between two of them where there is none; zeros where no two
    are known."""
    known = np.isfinite(values)
    # What moves somewhere in the log may have no number in its middle.
    if np.count_nonzero(known) < 2:
        return np.zeros_like(values)
    return (
        values
        if known.all()
        else np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
    )


def _of_length_one(rows: Sequence[NDArray]) -> NDArray:
    """Return vectors (n,) as the rows of a matrix, each divided by its length; those of no length
    are left."""
    matrix = np.array(rows)
    lengths = np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.divide(matrix, lengths, out=np.zeros_like(matrix), where=lengths > 0.0)


def _way(time_s: NDArray, velocity: NDArray) -> NDArray:
    """Return how far a velocity (n,) goes in each span of samples."""
    travel = np.concatenate(
        [[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s))]
    )
    return travel[SPAN:] - travel[:-SPAN]


def _through_origin(x: NDArray, y: NDArray) -> Agreement | None:
    """Return y = slope x; the mean of both regressions' slopes, for both columns have noise."""
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx == 0.0 or yy == 0.0 or xy == 0.0:
        return None
    return Agreement(float(np.sign(xy)) * np.sqrt(yy / xx), xy**2 / (xx * yy))


def mean_power(time_s: NDArray, angle: NDArray, torque: NDArray) -> tuple[float, float]:
    """Return mean and mean magnitude, W, of torque (n,) N·m times the derivative of the angle (n,)
    rad at times (n,) s.

    What a drive delivers between two instants of equal state can only have gone into friction: the
    mean is positive where the signs of both columns agree.
    """
    time_s, angle, torque = whole_rows(time_s, angle, torque)
    if len(time_s) < 5 * SPAN:
        return 0.0, 0.0
    velocity = (angle[SPAN:] - angle[:-SPAN]) / (time_s[SPAN:] - time_s[:-SPAN])
    averaged = np.convolve(torque, np.ones(SPAN + 1) / (SPAN + 1), "valid")
    power = averaged * velocity
    return float(np.mean(power)), float(np.mean(np.abs(power)))


def whole_rows(*columns: NDArray) -> list[NDArray]:
    """Return the rows of columns (n,), from the middle of the log, in which every column has a
    number."""
    columns = _middle(*columns)
    known = np.all([np.isfinite(column) for column in columns], axis=0)
    return [column[known] for column in columns]


def _middle(*columns: NDArray) -> tuple[NDArray, ...]:
    middle = slice(max(0, (len(columns[0]) - MOST) // 2), (len(columns[0]) + MOST) // 2)
    return tuple(column[middle] for column in columns)
