"""Colours, headings and legends that the figures of a diagnosis share."""

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure


def heading(drawn: Figure, words: str) -> None:
    """Write the heading of a figure above its left end."""
    drawn.suptitle(words, x=0.02, ha="left", fontweight="bold")


def legend_below(axis: Axes, handles: Mapping[str, Any], down: float, columns: int = 1) -> None:
    """Draw a legend, handles by words, so many heights of the axis below its bottom."""
    axis.legend(
        handles.values(),
        handles.keys(),
        loc="upper left",
        bbox_to_anchor=(-0.02, -down),
        fontsize=8,
        ncols=columns,
    )
