"""The rows of ``parameters/1`` of an identification, and their slopes by fitted values."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.baseline import Friction, RigidBody
from pipelines.estimation.parameter_table import Row, rows_of
from pipelines.estimation.problem import Training
from pipelines.model import BASELINE, Term


def rows(training: Training, values: NDArray) -> Iterator[Row]:
    """Return the rows of a ``parameters/1`` table, without those that nothing determines.

    Parameters
    ----------
    training : Training
        The fitted model and its runs.
    values : (p,) array
        Values of the columns, in their units.

    Returns
    -------
    iterator of Row
        Body alone, friction, body with a person, the person's, then extensions.
    """
    unknown = np.flatnonzero(training.undetermined)
    return (row for row in _rows(training, values) if not row.slope[unknown].any())


def _rows(training: Training, values: NDArray) -> Iterator[Row]:
    terms = list(_sloped(training, values))
    bodies = [one for one in terms if isinstance(one[0].effect, RigidBody)]
    # The layout has the machine's body first.
    machine, *wearer = bodies
    yield from _of_body([machine], "exo_alone", "friction")
    for term, slope in terms:
        if isinstance(term.effect, Friction):
            yield from rows_of(term.effect, term.values, slope, "friction")
    # Machine and wearer move together, so the parameters of both bodies add up.
    if wearer:
        yield from _of_body(bodies, "with_human", "inertia")
        yield from _of_body(wearer, "human", "inertia")
    for term, slope in terms:
        effect = term.effect
        if effect.name not in BASELINE:
            yield from rows_of(effect, term.values, slope, "extension", positive=effect.shape)


def _sloped(training: Training, values: NDArray) -> Iterator[tuple[Term, NDArray]]:
    """Yield each term with the first training run's values, and their slopes (v, p + s)."""
    layout = training.layout
    # Each fitted column, then each shape, has a slope of one along itself.
    units = np.eye(layout.shapes(len(layout.terms) - 1).stop)
    for number, term in enumerate(training.model):
        columns = layout.terms[number]
        slopes = np.zeros((len(term.linear), len(units)))
        # A term that acts in no training run keeps the values it came with, without slope.
        if columns.runs:
            first = columns.runs[0]
            slopes = units[columns.places(first)]
            term = training.term_of(training.runs[first], number, values) or term
        yield term, np.vstack([slopes, units[layout.shapes(number)]])


def _of_body(bodies: Sequence[tuple[Term, NDArray]], run: str, step: str) -> list[Row]:
    """Return the rows of the sum of some rigid bodies."""
    effect = RigidBody(run=run, on=bodies[0][0].effect.on)
    values, slopes = (
        np.sum(parts, axis=0) for parts in zip(*((t.values, s) for t, s in bodies), strict=True)
    )
    return rows_of(effect, values, slopes, step)
