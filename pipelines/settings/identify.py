"""``[identify]``: how the two-step fit is made, and what it leaves behind."""

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

    figures: bool = Field(
        True, description="Draw the figures, beside the parameters, as PNG and PDF."
    )
    method: Method = Field(
        "weighted_least_squares",
        description=(
            "Estimator of both steps; docs/estimators.md says which to use when. Instrumental"
            " variables need set-points in the recording; they and output error hold whole runs in"
            " memory."
        ),
    )
    reversals: bool = Field(
        False,
        description=(
            "Fit samples near a joint's reversals, too. No friction of the model describes what is"
            " there, so parameters are biased by it; for comparing with what others fit to every"
            " sample."
        ),
    )
