"""``parameters/1``: the rows of a fitted model, and their intervals."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter


@dataclass(frozen=True)
class Row:
    """One row of ``parameters/1``."""

    effect: Effect
    parameter: Parameter
    step: str
    value: float
    slope: NDArray
    """How it changes with what the covariance is of."""
    one_way: bool = False
    """Whether its interval ends at nought: of a cause that is there, as play or a stiffness."""


def rows_of(
    effect: Effect,
    values: NDArray,
    slopes: NDArray,
    step: str,
    positive: Collection[Parameter] = (),
) -> list[Row]:
    """Return the rows of an effect for its fitted values.

    Parameters
    ----------
    effect : Effect
        What the rows are of.
    values : (v,) array
        Of its linear parameters, then of its shape.
    slopes : (k, s) array
        How the first k of them change with what the covariance is of; the others are certain.
    step : str
        In which they were found.
    positive : collection of Parameter
        Of those, the interval of one that is never negative, as play or a stiffness, ends at zero.
    """
    of_rows = effect.jacobian(values)[:, : len(slopes)] @ slopes
    rows = zip(effect.parameters, effect.physical(values), of_rows, strict=True)
    return [
        Row(effect, p, step, float(value), slope, p in positive and p.typical[0] >= 0)
        for p, value, slope in rows
    ]


def table_of(rows: Sequence[Row], error: NDArray, critical: NDArray | float) -> pd.DataFrame:
    """Return ``parameters/1`` of r rows, whose standard errors are (r,), NaN of what was held and
    is not known.

    ``critical``, (r,) or one for all, is the half-width of their intervals in standard errors.
    """
    value = np.array([row.value for row in rows])
    ends = interval(value, critical * error, np.array([row.one_way for row in rows]))
    table = pd.DataFrame(
        {
            "name": [row.parameter.name for row in rows],
            "symbol": [row.parameter.symbol for row in rows],
            "joint": [row.effect.joint for row in rows],
            "run": [row.effect.run for row in rows],
            "value": value,
            "unit": [row.parameter.unit for row in rows],
            "std_error": error,
            "ci95_low": ends[:, 0],
            "ci95_high": ends[:, 1],
            "step": [row.step for row in rows],
            "effect": [row.effect.name for row in rows],
        }
    )
    own = [row.parameter.per_run for row in rows]
    return table.assign(each_run=own) if any(own) else table


def interval(value: NDArray, half: NDArray, one_way: NDArray) -> NDArray:
    """Return the ends of intervals about values (p,) with half-widths (p,): (p, 2).

    What is ``one_way`` (p,), play, a stiffness or a time constant, is never negative, however
    little is known of it.
    """
    low = value - half
    return np.stack(
        [np.where(one_way, np.minimum(np.maximum(low, 0.0), value), low), value + half], axis=1
    )
