"""Colours that the figures of a diagnosis share."""

from pipelines.plotting.style import BLUE, GREY

BEFORE, AFTER = GREY, BLUE
"""What the baseline leaves or simulates; what the extended model does."""
MEASURED = "black"
