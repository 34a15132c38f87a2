"""The figures of a session's page as PDF and PNG files."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipelines.plotting.matplotlib_charts import (
    NARROW,
    WIDE,
    chart_figure,
    legend_below,
    rows_of_axes,
    sentence,
)
from pipelines.plotting.style import BLUE, CAUSES, GREY, NOISE, STYLE, WANDERS, save
from pipelines.report.sections.error_budget import Bar, Fall, budget, falls
from pipelines.report.session import Session
from pipelines.report.session_charts import charts
from pipelines.wording.numbers import digits

Drawings = dict[str, Callable[[], Figure]]
"""Functions that draw a figure, by the name of its file."""


def figures(session: Session) -> Drawings:
    """Return the functions that draw the figures of a session's page, by file name."""
    drawings: Drawings = {}
    if session.verdict:
        drawings["error"] = partial(_falls_figure, falls(session.verdict))
        drawings["error-budget"] = partial(_budget_figure, budget(session.verdict))
    # Functions, not figures: a session has dozens, and only the chosen ones are drawn.
    return drawings | {chart.key: partial(chart_figure, chart) for chart in charts(session).all}


def draw(
    drawings: Drawings, names: Sequence[str], folder: Path, report: Callable[[float], None]
) -> None:
    """Write figures as PDF and PNG into a folder; ``report`` receives the number written."""
    with plt.rc_context(STYLE | {"savefig.dpi": 200}):
        for number, name in enumerate(names):
            save(drawings[name](), folder / name)
            report(number + 1)


def _budget_figure(bars: Sequence[Bar]) -> Figure:
    """Return the figure of the error budget: one bar per joint, each with its own scale."""
    figure, axes = rows_of_axes(len(bars), (WIDE, 0.5 + 1.25 * len(bars)))
    tones = {"noise": NOISE, "left": BLUE, "wanders": WANDERS} | {
        f"cause{n}": c for n, c in enumerate(CAUSES, 1)
    }
    for axis, bar in zip(axes, bars, strict=True):
        shown = [segment for segment in bar.segments if segment.share]
        for s in shown:
            axis.barh(0, s.high - s.low, left=s.low, color=tones[s.tone], ec="white", lw=0.5)
        axis.set_yticks([])
        title = sentence(f"{bar.joint}: {digits(bar.rms)} {bar.unit} rms")
        axis.set_title(title, loc="left", fontsize=9)
        axis.set_xlabel(f"mean square error, ({bar.unit})²")
        axis.grid(visible=False)
        patches = [Patch(color=tones[s.tone]) for s in shown]
        labels = [f"{s.label}: {digits(s.rms)} {bar.unit}" for s in shown]
        axis.legend(patches, labels, loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8)
    return figure


def _falls_figure(falls: Sequence[Fall]) -> Figure:
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
    axis.set_xlabel(f"rms error on data that no fit has seen, {units}")
    axis.grid(axis="y", visible=False)
    legend: dict[str, Artist] = {"rigid body and friction": Patch(color=GREY)}
    if falls[0].after is not None:
        legend["with the causes"] = Patch(color=BLUE)
    legend["noise floor"] = Line2D([], [], color="black")
    legend_below(figure, legend, 7)
    return figure
