"""A diagnosis as if the posterior had named given causes: for tests of what comes after the decision."""

from dataclasses import replace

from pipelines.diagnosis.diagnose import _validated
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.selection.answer import Answer, Named
from pipelines.diagnosis.selection.findings import findings

PROBABILITY = 0.97


def naming(d: Diagnosis, *labels: str, ties: tuple[tuple[str, float], ...] = ()) -> Diagnosis:
    """Return the diagnosis with these causes named, the first with ties, fitted and validated."""
    selected = d.selected
    assert selected.library is not None and selected.posterior is not None
    named = tuple(
        Named(_best(d, label), PROBABILITY, PROBABILITY, ties if number == 0 else ())
        for number, label in enumerate(labels)
    )
    answer = Answer(named, 0.0, 0.0)
    found = tuple(findings(selected.posterior, answer))
    fitted = _validated(d.data, selected.library.prepared, replace(selected, answer=answer, findings=found))
    # What the posterior itself holds beside them is another answer's.
    causes = tuple(one for one in fitted.selected.findings if one.level == "cause")
    return replace(fitted, selected=replace(fitted.selected, findings=causes))


def _best(d: Diagnosis, label: str):
    """Return the element of a cause at its best shape alone, the same in all runs."""
    return next(
        element
        for element in d.selected.posterior.elements
        if element.label == label and element.first and not element.each_run and not element.worn
    )


def missing(d: Diagnosis, probability: float) -> Diagnosis:
    """Return the diagnosis with nothing named and such a probability that something is missing."""
    selected = replace(d.selected, answer=Answer((), 1.0 - probability, probability), findings=())
    return replace(d, selected=selected, after=d.before, without={})
