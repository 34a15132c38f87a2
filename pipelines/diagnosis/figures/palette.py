"""Colours and words that the figures of a diagnosis share."""

from pipelines.model import effect_named
from pipelines.plots import BLUE, GREY, ORANGE

BEFORE, AFTER, CAUSE = GREY, BLUE, ORANGE
"""What the baseline leaves or simulates; what the extended model does; what a cause makes of it."""
NOISE = "#d5dae1"
MEASURED = "black"


def in_words(label: str) -> str:
    """Return ``cogging@knee`` as ``cogging at the knee``."""
    name, _, joint = label.partition("@")
    title = effect_named(name).title.lower()
    return f"{title} at the {joint}" if joint else title
