"""Charts, drawn by matplotlib."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipelines.plotting.chart import Chart, Mark, Panel, Role, Series
from pipelines.plotting.style import BLUE, GREY, NOISE

WIDE, NARROW = 7.2, 3.6
"""Widths of two columns of a paper and of one, inches."""


def chart_figure(chart: Chart) -> Figure:
    """Return the figure of a chart, its panels one above the other."""
    # No printer resolves more rows, and the PDF would open slowly.
    chart = chart.thinned(6000)
    cloud = any(series.mark is Mark.DOTS for series in chart.all_series)
    heights = [2.0] + [1.3 if chart.group else 2.0] * (len(chart.panels) - 1)
    size = (NARROW if cloud else WIDE, 0.7 + 0.85 * sum(heights))
    figure, axes = rows_of_axes(len(chart.panels), size, sharex=True, height_ratios=heights)
    for axis, panel in zip(axes, chart.panels, strict=True):
        _draw(axis, chart, panel)
    axes[-1].set_xlabel(chart.x_label)
    _complete(figure, chart.title, axes)
    return figure


def grid_figure(title: str, grid: Sequence[Sequence[Chart]]) -> Figure:
    """Return the figure of charts of one panel each, in rows of one height and unit.

    Parameters
    ----------
    title : str
        Title of the figure; those of the charts are not drawn.
    grid : sequence of sequences of Chart
        Rows of equally many charts.
    """
    size = (NARROW * len(grid[0]), 0.5 + 2.4 * len(grid))
    figure, axes = plt.subplots(
        len(grid), len(grid[0]), figsize=size, squeeze=False, sharey="row", layout="constrained"
    )
    for row, charts in zip(axes, grid, strict=True):
        for axis, chart in zip(row, charts, strict=True):
            _draw(axis, chart, chart.panels[0])
            axis.set_xlabel(chart.x_label)
        for axis in row[1:]:
            axis.set_ylabel("")
    _complete(figure, title, axes.flat)
    return figure


def rows_of_axes(count: int, size: tuple[float, float], **options: Any) -> tuple[Figure, NDArray]:
    """Return a figure of so many axes, one above the other, and the axes (n,)."""
    figure, axes = plt.subplots(
        count, 1, figsize=size, squeeze=False, layout="constrained", **options
    )
    return figure, axes[:, 0]


def _complete(figure: Figure, title: str, axes: Iterable[Axes]) -> None:
    # matplotlib marks lines without a legend by an underscore.
    lines = [line for axis in axes for line in axis.get_lines()]
    shown = {str(line.get_label()): line for line in lines if str(line.get_label())[0] != "_"}
    figure.suptitle(sentence(title), x=0.01, ha="left", fontsize=9, fontweight="bold")
    legend_below(figure, shown, 8)
    figure.align_ylabels()


def legend_below(figure: Figure, artists: Mapping[Any, Artist], size: float) -> None:
    """Draw one legend below all axes, of artists by their labels."""
    if artists:
        look: dict[str, Any] = {"ncols": len(artists), "fontsize": size}
        figure.legend(artists.values(), artists.keys(), loc="outside lower left", **look)


def _draw(axis: Axes, chart: Chart, panel: Panel) -> None:
    if panel.band:
        axis.axhspan(-panel.band, panel.band, color=NOISE, alpha=0.6, lw=0)
    for series in panel.series:
        _draw_series(axis, chart, series)
    axis.set_ylabel(panel.label)
    axis.margins(x=0.01)
    if panel.reach:
        axis.set_ylim(-panel.reach, panel.reach)


def _draw_series(axis: Axes, chart: Chart, series: Series) -> None:
    colours = {Role.MEASURED: "black", Role.WANTED: "black", Role.BEFORE: GREY, Role.AFTER: BLUE}
    colour, label = colours[series.role], series.label or "_"
    x, values = chart.x, series.values
    if series.mark is Mark.DOTS:
        # Rasterized, as thousands of dots as vectors make a PDF slow to open.
        dots: dict[str, Any] = {"ms": 3.0, "mew": 0, "alpha": 0.5, "rasterized": True}
        axis.plot(x, values, ".", color=colour, label=label, **dots)
        return
    if series.mark is Mark.MEAN:
        # Means stand between rows of dots, over which the line must go on.
        known = ~np.isnan(values)
        x, values = x[known], values[known]
    widths = {Role.MEASURED: 0.7, Role.WANTED: 0.7, Role.BEFORE: 1.6, Role.AFTER: 0.9}
    width = 1.8 if series.mark is Mark.MEAN else widths[series.role]
    axis.plot(x, values, color=colour, lw=width, label=label)


def sentence(text: str) -> str:
    """Return a text with a capital first letter."""
    return text[:1].upper() + text[1:]
