"""A diagnosis as if the posterior had named given causes: for tests of what comes after the
decision."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.judged_fit import judged_fit
from pipelines.diagnosis.selection.answer import Answer, NamedCause
from pipelines.diagnosis.selection.findings import findings
from pipelines.diagnosis.selection.posterior import Posterior

PROBABILITY = 0.97


def naming(d: Diagnosis, *labels: str, ties: tuple[tuple[str, float], ...] = ()) -> Diagnosis:
    """Return the diagnosis with these causes named, the first with ties, fitted and validated."""
    selected = d.selected
    assert selected.library is not None and selected.posterior is not None
    elements = [_best(d, label) for label in labels]
    named = tuple(
        NamedCause(element, PROBABILITY, PROBABILITY, ties if number == 0 else ())
        for number, element in enumerate(elements)
    )
    chosen = tuple(sorted(selected.posterior.elements.index(element) for element in elements))
    # Each is as likely with the others as without them.
    sets = [some for size in range(len(chosen), -1, -1) for some in combinations(chosen, size)]
    log_odds = [len(some) * (np.log(PROBABILITY) - np.log1p(-PROBABILITY)) for some in sets]
    weighed = Posterior(selected.posterior.elements, tuple(sets), np.array(log_odds))
    answer = Answer(named, 1.0 - PROBABILITY, 0.0)
    reported = tuple(findings(weighed, answer))
    compared = {element.variant: 0.0 for element in elements}  # the ties that were asked for stay
    given = replace(
        selected,
        searched=weighed,
        posterior=weighed,
        charged=compared,
        answer=answer,
        findings=reported,
        dropped=frozenset(),
    )
    return Diagnosis.of(d.data, d.noise, judged_fit(given, d.scheme, d.noise))


def _best(d: Diagnosis, label: str):
    """Return the element of a cause at its best shape alone, the same in all runs."""
    return next(
        element
        for element in d.selected.posterior.elements
        if element.label == label
        and element.is_best_shape
        and not element.each_run
        and not element.worn
    )


def missing(d: Diagnosis, probability: float) -> Diagnosis:
    """Return the diagnosis with nothing named and such a probability that something is missing."""
    selected = replace(d.selected, answer=Answer((), 1.0 - probability, probability), findings=())
    return replace(d, selected=selected, after=d.before, without={})
