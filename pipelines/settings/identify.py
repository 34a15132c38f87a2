"""``[identify]``: the two-step fit and its output."""

from typing import Literal

from pydantic import Field

from pipelines.settings.base import Settings

Method = Literal[
    "weighted_least_squares",
    "ordinary_least_squares",
    "iteratively_reweighted",
    "instrumental_variables",
    "output_error",
    "realizable",
]


class IdentifySettings(Settings):
    """The two-step fit: friction from exo_alone runs, then inertia with the human."""

    figures: bool = Field(True, description="Draw figures next to the parameters, as PNG and PDF.")
    method: Method = Field(
        "weighted_least_squares", description="Estimator of both steps; see docs/estimators.md."
    )
    reversals: bool = Field(
        False, description="Fit samples near a joint's reversals too, where friction is biased."
    )
