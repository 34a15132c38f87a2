"""The style of exoid's figures, and the writing of their files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from pipelines.contracts.atomic import whole_file

GREY, ORANGE, BLUE = "#7a869a", "#c2410c", "#1d4ed8"
"""Baseline; first cause, and limits; model with the causes."""
NOISE, WANDERS, CAUSES = "#d5dae1", "#93b4f5", (ORANGE, "#f59e0b", "#7c2d12")
"""Parts of an error budget: noise floor, non-repeating part, each cause; the rest is blue."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "figure.dpi": 130,
}


def save(figure: Figure, stem: Path, kinds: Sequence[str] = ("png", "pdf")) -> None:
    """Write a figure as ``stem``.png and ``stem``.pdf, or the one of them, and close it."""
    # Laid out once, before the figure is measured: else each file would lay it out again.
    if figure.get_layout_engine():
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    # Measured once for both: bbox_inches="tight" would lay out and measure every text again for
    # each.
    box = figure.get_tightbbox().padded(plt.rcParams["savefig.pad_inches"])
    for kind in kinds:
        with whole_file(stem.with_name(f"{stem.name}.{kind}")) as path:
            # Without a date, equal figures are equal files, and nothing becomes stale.
            undated = {"CreationDate": None} if kind == "pdf" else None
            figure.savefig(path, format=kind, bbox_inches=box, metadata=undated)
    plt.close(figure)
