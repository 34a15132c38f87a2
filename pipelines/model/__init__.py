"""The model that all stages share: effects with values, their regressor, and its column layout."""

from pipelines.model.baseline import BASELINE, baseline
from pipelines.model.model import BY_NAME, Model, Motions, Term, effect_named, term_from
from pipelines.model.parameter_layout import Column, ParameterLayout, TermColumns
from pipelines.model.parameters_table import (
    complete_bodies,
    model_from_parameters,
    terms_next_to_bodies,
    unrealizable,
    upside_down,
)

__all__ = [
    "BASELINE",
    "BY_NAME",
    "Column",
    "Model",
    "Motions",
    "ParameterLayout",
    "Term",
    "TermColumns",
    "baseline",
    "complete_bodies",
    "effect_named",
    "model_from_parameters",
    "term_from",
    "terms_next_to_bodies",
    "unrealizable",
    "upside_down",
]
