"""Colours that the figures of a diagnosis share."""

from pipelines.plots import BLUE, GREY, ORANGE

BEFORE, AFTER, CAUSE = GREY, BLUE, ORANGE
"""What the baseline leaves or simulates; what the extended model does; what a cause makes of it."""
NOISE = "#d5dae1"
MEASURED = "black"
