"""The page's charts, drawn by matplotlib."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pipelines.plotting.style import BLUE, CAUSES, GREY, NOISE, WANDERS
from pipelines.report.charts.bars import Bar, Fall
from pipelines.report.charts.chart import Chart, Mark, Panel, Role, Series
from pipelines.report.numbers import digits

ROWS = 6000
"""Most rows of a chart: no printer resolves more, and the PDF would open slowly."""
COLOURS = {Role.MEASURED: "black", Role.WANTED: "black", Role.BEFORE: GREY, Role.AFTER: BLUE}
WIDTHS = {Role.MEASURED: 0.7, Role.WANTED: 0.7, Role.BEFORE: 1.6, Role.AFTER: 0.9}
TONES = {"noise": NOISE, "left": BLUE, "wanders": WANDERS} | {
    f"cause{n}": c for n, c in enumerate(CAUSES, 1)
}
WIDE, NARROW = 7.2, 3.6
"""Widths of two columns of a paper and of one, inches."""


def chart_figure(chart: Chart) -> Figure:
    """Return the figure of a chart, its panels one above the other."""
    chart = chart.thinned(ROWS)
    cloud = any(series.mark is Mark.DOTS for series in chart.all_series)
    heights = [2.0] + [1.3 if chart.group else 2.0] * (len(chart.panels) - 1)
    size = (NARROW if cloud else WIDE, 0.7 + 0.85 * sum(heights))
    figure, axes = _rows(len(chart.panels), size, sharex=True, height_ratios=heights)
    for axis, panel in zip(axes, chart.panels, strict=True):
        _draw(axis, chart, panel)
    axes[-1].set_xlabel(chart.x_label)
    # matplotlib marks lines without a legend by an underscore.
    lines = [line for axis in axes for line in axis.get_lines() if line.get_label()[0] != "_"]
    figure.suptitle(_sentence(chart.title), x=0.01, ha="left", fontsize=9, fontweight="bold")
    _legend(figure, {line.get_label(): line for line in lines}, 8)
    figure.align_ylabels()
    return figure


def _rows(count: int, size: tuple[float, float], **options: Any) -> tuple[Figure, NDArray]:
    figure, axes = plt.subplots(
        count, 1, figsize=size, squeeze=False, layout="constrained", **options
    )
    return figure, axes[:, 0]


def _legend(figure: Figure, artists: Mapping[Any, Artist], size: float) -> None:
    if artists:
        look: dict[str, Any] = {"ncols": len(artists), "fontsize": size}
        figure.legend(artists.values(), artists.keys(), loc="outside lower left", **look)


def _draw(axis: Axes, chart: Chart, panel: Panel) -> None:
    if panel.band:
        axis.axhspan(-panel.band, panel.band, color=TONES["noise"], alpha=0.6, lw=0)
    for series in panel.series:
        _draw_series(axis, chart, series)
    axis.set_ylabel(panel.label)
    axis.margins(x=0.01)
    if panel.reach:
        axis.set_ylim(-panel.reach, panel.reach)


def _draw_series(axis: Axes, chart: Chart, series: Series) -> None:
    colour, label = COLOURS[series.role], series.label or "_"
    x, values = chart.x, series.values
    if series.mark is Mark.DOTS:
        # Rasterized, as thousands of dots as vectors make a PDF slow to open.
        dots: dict[str, Any] = {"ms": 1.6, "mew": 0, "alpha": 0.5, "rasterized": True}
        axis.plot(x, values, ".", color=colour, label=label, **dots)
        return
    if series.mark is Mark.MEAN:
        # Means stand between rows of dots, over which the line must go on.
        known = ~np.isnan(values)
        x, values = x[known], values[known]
    width = 1.8 if series.mark is Mark.MEAN else WIDTHS[series.role]
    axis.plot(x, values, color=colour, lw=width, label=label)


def budget_figure(bars: Sequence[Bar]) -> Figure:
    """Return the figure of the error budget: one bar per joint, each with its own scale."""
    figure, axes = _rows(len(bars), (WIDE, 0.5 + 1.25 * len(bars)))
    for axis, bar in zip(axes, bars, strict=True):
        shown = [segment for segment in bar.segments if segment.share]
        for s in shown:
            axis.barh(0, s.high - s.low, left=s.low, color=TONES[s.tone], ec="white", lw=0.5)
        axis.set_yticks([])
        title = _sentence(f"{bar.joint}: {digits(bar.rms)} {bar.unit} rms")
        axis.set_title(title, loc="left", fontsize=9)
        axis.set_xlabel(f"mean square error, ({bar.unit})²")
        axis.grid(visible=False)
        patches = [Patch(color=TONES[s.tone]) for s in shown]
        labels = [f"{s.label}: {digits(s.rms)} {bar.unit}" for s in shown]
        axis.legend(patches, labels, loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8)
    return figure


def falls_figure(falls: Sequence[Fall]) -> Figure:
    """Return the figure of each joint's error without and with the causes, and its noise floor."""
    figure, axis = plt.subplots(figsize=(NARROW, 0.6 + 0.75 * len(falls)), layout="constrained")
    for row, fall in enumerate(falls):
        bars = [(fall.before, GREY)] + ([(fall.after, BLUE)] if fall.after is not None else [])
        for shift, (value, colour) in zip((-0.19, 0.19), bars, strict=False):
            axis.barh(row + shift, value, height=0.34, color=colour)
        axis.plot([fall.floor] * 2, [row - 0.42, row + 0.42], color="black", lw=1.4)
    units = " and ".join(dict.fromkeys(fall.unit for fall in falls))
    axis.set_yticks(range(len(falls)), [fall.joint for fall in falls])
    axis.invert_yaxis()
    axis.set_xlabel(f"rms error on runs that no fit has seen, {units}")
    axis.grid(axis="y", visible=False)
    legend: dict[str, Artist] = {"rigid body and friction": Patch(color=GREY)}
    if falls[0].after is not None:
        legend["with the causes"] = Patch(color=BLUE)
    legend["noise floor"] = Line2D([], [], color="black")
    _legend(figure, legend, 7)
    return figure


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
