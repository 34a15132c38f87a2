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
        "weighted_least_squares",
        description=(
            "Estimator of both steps; docs/estimators.md explains the choice. Instrumental"
            " variables need set-points in the recording; they and output error hold whole runs in"
            " memory."
        ),
    )
    reversals: bool = Field(
        False,
        description=(
            "Fit samples near a joint's reversals, too. The model's friction is wrong there, so"
            " parameters are biased; for comparison with fits of other tools to every sample."
        ),
    )
