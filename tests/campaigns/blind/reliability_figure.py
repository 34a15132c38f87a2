"""Reliability diagram: the probability that was said against how often it was so (Murphy and
Winkler, 1977)."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from pipelines.plotting.style import BLUE, GREY, STYLE, save
from tests.campaigns.blind.scoring import Score
from tests.campaigns.blind.statistics import Bin, reliability


def draw(scores: Sequence[Score], path: Path) -> None:
    """Write the diagram as PNG."""
    with plt.rc_context(STYLE):
        save(
            figure(reliability([f for s in scores for f in s.probabilities])),
            path.with_suffix(""),
            ("png",),
        )


def figure(curve: Sequence[Bin]) -> Figure:
    """Draw a point for each bin, with Wilson's 95 % interval and its number of forecasts."""
    drawn, (axis, counts) = plt.subplots(
        2, 1, figsize=(4.2, 5.2), sharex=True, height_ratios=(4, 1)
    )
    axis.plot([0, 1], [0, 1], color=GREY, lw=1, label="as said")
    stated = [b.mean for b in curve]
    was = [b.happened.value for b in curve]
    low, high = zip(*(b.happened.interval for b in curve), strict=True) if curve else ((), ())
    # Rounding may put an interval's end a hair inside its point; a bar cannot be shorter than
    # nothing.
    below = [max(0.0, w - end) for w, end in zip(was, low, strict=True)]
    above = [max(0.0, end - w) for w, end in zip(was, high, strict=True)]
    axis.errorbar(
        stated,
        was,
        yerr=[below, above],
        fmt="o",
        ms=5,
        color=BLUE,
        capsize=3,
        label="measured, Wilson 95 %",
    )
    axis.set(ylabel="share of causes that were there", ylim=(-0.03, 1.03))
    axis.legend(loc="lower right")
    widths = [b.high - b.low for b in curve]
    numbers = [b.happened.cases for b in curve]
    bars = counts.bar(
        [b.low for b in curve], numbers, widths, align="edge", color=GREY, edgecolor="white"
    )
    counts.bar_label(bars, fontsize=7, padding=1)
    counts.set(xlabel="probability said of a named cause", ylabel="causes", xlim=(-0.03, 1.03))
    counts.margins(y=0.3)
    counts.grid(False)
    drawn.align_ylabels()
    drawn.tight_layout()
    return drawn
