"""The rows of ``parameters/1`` that an identification writes, and how each goes with what was fitted and held."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody
from pipelines.estimation.parameter_table import Row
from pipelines.estimation.problem import Training
from pipelines.model import BASELINE, Term


def rows(training: Training, values: NDArray) -> Iterator[Row]:
    """Yield the rows for some values of the columns, (p,)."""
    terms = list(_sloped(training, values))
    bodies = [one for one in terms if isinstance(one[0].effect, RigidBody)]
    machine, *wearer = bodies
    yield from _of_body([machine], "exo_alone", "friction")
    for term, slope in terms:
        if isinstance(term.effect, Friction):
            yield from _rows_of(term, slope, "friction")
    if wearer:
        yield from _of_body(bodies, "with_human", "inertia")
        yield from _of_body(wearer, "human", "inertia")
    for term, slope in terms:
        if term.effect.name not in BASELINE:
            yield from _rows_of(term, slope, "extension")


def _sloped(training: Training, values: NDArray) -> Iterator[tuple[Term, NDArray]]:
    """Yield each term, as the first run to train on that has it has it, and how its values change, (v, p + s)."""
    p, shape = len(values), len(values)
    s = sum(len(term.shape) for term in training.model)
    for i, term in enumerate(training.model):
        slope = np.zeros((len(term.values), p + s))
        having = next((run for run in training.runs if training.has(run, i)), None)
        places = [training.place(i, k, having) for k in range(len(term.linear))] if having else []
        for k, at in enumerate(places):
            if at is not None:
                slope[k, at] = 1.0
        for k in range(len(term.shape)):
            slope[len(term.linear) + k, shape + k] = 1.0
        shape += len(term.shape)
        yield (training.term_of(having, i, values) if having else None) or term, slope


def _of_body(bodies: Sequence[tuple[Term, NDArray]], run: str, step: str) -> Iterator[Row]:
    """Yield the rows of the sum of some rigid bodies."""
    on = bodies[0][0].effect.on
    term = Term(RigidBody(run=run, on=on), np.sum([term.values for term, _ in bodies], axis=0))
    yield from _rows_of(term, np.sum([slope for _, slope in bodies], axis=0), step)


def _rows_of(term: Term, slope: NDArray, step: str) -> Iterator[Row]:
    effect = term.effect
    slopes = effect.jacobian(term.values) @ slope
    for parameter, value, of_parameter in zip(effect.parameters, effect.physical(term.values), slopes, strict=True):
        one_way = parameter in effect.shape and parameter.typical[0] >= 0
        yield Row(effect, parameter, step, float(value), of_parameter, one_way)
