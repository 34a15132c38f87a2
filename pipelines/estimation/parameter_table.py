"""Rows and intervals of a fitted model, for ``parameters/1``."""

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
    """Derivative of the value with respect to the parameters of the covariance."""
    one_way: bool = False
    """Whether the interval ends at zero, as of a play or a stiffness of a cause that is present."""


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
        Effect of the rows.
    values : (v,) array
        Values of its linear parameters, then of its shape.
    slopes : (k, s) array
        Derivatives of the first k values with respect to the parameters of the covariance; the
        other values are certain.
    step : str
        Step of the identification that fitted them.
    positive : collection of Parameter
        Parameters of a cause that is present. The interval of one that is never negative, such as a
        play or a stiffness, ends at zero.
    """
    # Chain rule from fitted to physical values.
    of_rows = effect.jacobian(values)[:, : len(slopes)] @ slopes
    rows = zip(effect.parameters, effect.physical(values), of_rows, strict=True)
    return [
        Row(effect, p, step, float(value), slope, p in positive and p.typical[0] >= 0)
        for p, value, slope in rows
    ]


def table_of(rows: Sequence[Row], error: NDArray, critical: NDArray | float) -> pd.DataFrame:
    """Build the ``parameters/1`` table of r rows.

    Parameters
    ----------
    rows : sequence of Row
        Its r rows.
    error : (r,) array
        Standard errors; NaN for a held value of unknown error.
    critical : (r,) array or float
        Half-width of the intervals in standard errors.
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
    """Return the ends of confidence intervals.

    Parameters
    ----------
    value : (p,) array
        Values.
    half : (p,) array
        Half-widths.
    one_way : (p,) bool array
        Whether a value is never negative, as a play, a stiffness or a time constant is.

    Returns
    -------
    (p, 2) array
        Lower and upper end, in the unit of the value.
    """
    low = value - half
    # An interval contains its value, even one below zero that should be positive.
    return np.stack(
        [np.where(one_way, np.minimum(np.maximum(low, 0.0), value), low), value + half], axis=1
    )
