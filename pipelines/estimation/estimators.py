"""Every estimator of exoid; docs/estimators.md compares them.

A new one needs a file, a line here, and its name in ``[identify] method``.
"""

from pipelines.errors import InputError
from pipelines.estimation.estimator import Estimator
from pipelines.estimation.instrumental_variables import InstrumentalVariables
from pipelines.estimation.iteratively_reweighted import IterativelyReweighted
from pipelines.estimation.least_squares import OrdinaryLeastSquares, WeightedLeastSquares
from pipelines.estimation.output_error import OutputError
from pipelines.estimation.realizable import Realizable
from pipelines.validation.suggestion import suggestion

ESTIMATORS: tuple[type[Estimator], ...] = (
    WeightedLeastSquares,
    OrdinaryLeastSquares,
    IterativelyReweighted,
    InstrumentalVariables,
    OutputError,
    Realizable,
)


def estimator_named(name: str) -> Estimator:
    """Return the estimator of a name, as exoid.toml and ``--method`` spell it, or of a short name.

    Raises
    ------
    InputError
        If no estimator has this name.
    """
    known = {name: one for one in ESTIMATORS for name in (one.name, one.short) if name}
    if name not in known:
        raise InputError(f"--method: there is no method {name!r}; {suggestion(name, list(known))}")
    return known[name]()
