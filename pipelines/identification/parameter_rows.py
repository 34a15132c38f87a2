"""The rows of ``parameters/1`` that an identification writes, and how each goes with what was fitted and held."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter
from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody
from pipelines.identification.extension import Extension
from pipelines.model import BASELINE, Model, Term


@dataclass(frozen=True)
class Row:
    """One row of ``parameters/1``."""

    effect: Effect
    parameter: Parameter
    step: str
    value: float
    slope: NDArray
    """(p + s,) how it changes with the model's linear values and the shapes that are held."""


def rows(model: Model, extension: Extension, values: NDArray) -> Iterator[Row]:
    """Yield the rows of ``parameters/1`` for some linear values of the model, (p,)."""
    every = np.append(values, extension.shapes)
    slopes = list(zip(model, _slopes(model, len(every)), strict=True))

    def of(effect: Effect, slope: NDArray, step: str) -> Iterator[Row]:
        return _rows_of(Term(effect, slope @ every), slope, step)

    for kind, slope in _bodies([one for one in slopes if isinstance(one[0].effect, RigidBody)]).items():
        body = RigidBody(run=kind, on=model.terms[0].effect.on)
        yield from of(body, slope, "friction" if kind == "exo_alone" else "inertia")
        if kind == "exo_alone":
            for term, slope in slopes:
                if isinstance(term.effect, Friction):
                    yield from of(term.effect, slope, "friction")
    for term, slope in slopes:
        if term.effect.name not in BASELINE:
            yield from of(term.effect, slope, "extension")
    for term in extension.held:
        yield from _rows_of(term, np.zeros((len(term.values), len(every))), "extension")


def _slopes(model: Model, size: int) -> Iterator[NDArray]:
    """Yield which of all linear values, and all shapes after them, are each term's, (v, size) of ones and noughts."""
    units, linear = np.eye(size), 0
    shape = len(model.linear_parameters)
    for term in model:
        ends = linear + len(term.linear), shape + len(term.shape)
        yield np.vstack([units[linear : ends[0]], units[shape : ends[1]]])
        linear, shape = ends


def _bodies(bodies: Sequence[tuple[Term, NDArray]]) -> dict[str, NDArray]:
    """Return how the rigid body of each kind of run, and the wearer's own, go with all values, (k, size) each."""
    (term, first), *others = bodies
    if not others:
        return {"exo_alone": first}
    ((_, second),) = others
    if term.effect.run is None:
        return {"exo_alone": first, "with_human": first + second, "human": second}
    return {"exo_alone": first, "with_human": second, "human": second - first}


def _rows_of(term: Term, slope: NDArray, step: str) -> Iterator[Row]:
    """Yield the rows of a term whose values change with all values by ``slope`` (v, size)."""
    effect = term.effect
    slopes = effect.jacobian(term.values) @ slope
    for parameter, value, of_parameter in zip(effect.parameters, effect.physical(term.values), slopes, strict=True):
        yield Row(effect, parameter, step, float(value), of_parameter)


def table_of(rows: Sequence[Row], covariance: NDArray, critical: NDArray) -> pd.DataFrame:
    """Return ``parameters/1`` of r rows with their covariance (r, r) and half-widths (r,) in standard errors.

    What has no variance was held, and has no error.
    """
    value = np.array([row.value for row in rows])
    variance = np.diag(covariance)
    error = np.where(variance > 0.0, np.sqrt(np.maximum(variance, 0.0)), np.nan)
    table = pd.DataFrame(
        {
            "name": [row.parameter.name for row in rows],
            "symbol": [row.parameter.symbol for row in rows],
            "joint": [row.effect.joint for row in rows],
            "run": [row.effect.run for row in rows],
            "value": value,
            "unit": [row.parameter.unit for row in rows],
            "std_error": error,
            "ci95_low": value - critical * error,
            "ci95_high": value + critical * error,
            "step": [row.step for row in rows],
            "effect": [row.effect.name for row in rows],
        }
    )
    own = [row.parameter.per_run for row in rows]
    return table.assign(each_run=own) if any(own) else table
