"""Colours that the figures of a diagnosis share."""

from pipelines.plotting.style import BLUE, GREY

BEFORE, AFTER = GREY, BLUE
"""Residual or simulation of the baseline, and of the extended model."""
MEASURED = "black"
