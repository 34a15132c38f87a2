"""Draw the first figure: how residuals repeat, their dependence, and their explanation."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures.shared import legend_below
from pipelines.diagnosis.verdict.findings_in_words import family_of
from pipelines.plotting.style import BLUE, GREY, NOISE, WANDERS
from pipelines.wording.findings import PARTS, VARIABLES, searched_runs
from pipelines.wording.label import label_in_words
from pipelines.wording.law import LAW

COLOURS = {
    "noise": NOISE,
    "wanders": WANDERS,
    "between_runs": "#5b87e5",
    "unsplit": GREY,
    "repeats": BLUE,
}
"""Colours of the residual's parts: the more of it a model could explain, the darker."""
FAMILIES = {
    "person": "#3b0764",
    "transmission": "#7c2d12",
    "angle": "#7e22ce",
    "speed": "#0f766e",
    "load": "#ea580c",
    "reversal": "#65a30d",
    "sensor": "#f59e0b",
    "time": "#fde68a",
}
"""Colours of the families of laws, by rising lightness, so that they differ in grey too."""


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw the residual's shares on the left, and the posterior over sets on the right."""
    bars = _bars(d)
    lines = sum(_height(bar) for bar in bars)
    # A line of a label is 0.17 inches high.
    drawn = plt.figure(figsize=(11, max(4.4, 0.17 * lines + 1.3)), layout="constrained")
    grid = drawn.add_gridspec(2, 2, width_ratios=[1, 1.1], height_ratios=[1.25, 1])
    _shares(drawn.add_subplot(grid[0, 0]), verdict)
    _dependence(drawn.add_subplot(grid[1, 0]), verdict)
    _sets(drawn.add_subplot(grid[:, 1]), bars)
    drawn.draw_without_rendering()  # lays out: callers measure the figure
    return drawn


def _shares(axis: Axes, verdict: Verdict) -> None:
    """Draw a bar for each joint, split into the parts of its residual."""
    seen: dict[str, Patch] = {}
    with_person = "of it with a person only"
    router = verdict.router
    # Share below which a part has no entry in the legend.
    negligible = 0.01
    for row, shares in enumerate(router.values()):
        start = 0.0
        for part, colour in COLOURS.items():
            share = getattr(shares, part) or 0.0
            axis.barh(row, share, 0.6, start, color=colour, edgecolor="white", lw=0.8)
            if share > 0.08:  # its number fits in it
                _number(axis, row, start, share, part)
            if share > negligible:
                seen[PARTS[part]] = Patch(color=colour)
            start += share
            # What shows with a person only is a part of what repeats, at its right end.
            person = min(shares.with_person_only or 0.0, share) if part == "repeats" else 0.0
            if person > negligible:
                axis.barh(
                    row, person, 0.6, start - person, fill=False, hatch="..", ec="white", lw=0
                )
                seen[with_person] = Patch(facecolor=BLUE, hatch="...", edgecolor="white")
    units = {joint: of["torque"] for joint, of in verdict.units.items()}
    names = [f"{j}\n{router[j].rms_nm:.3g} {units[j]} rms" for j in router]
    axis.set_yticks(range(len(names)), names)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.set_xlim(0.0, 1.0)
    axis.grid(visible=False)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x:.0%}")
    axis.set_xlabel(
        f"share of the mean square, 0.1 s averages, {searched_runs(verdict)}", fontsize=8
    )
    words = [*(PARTS[part] for part in COLOURS), with_person]
    legend_below(axis, {one: seen[one] for one in words if one in seen}, 0.32, 2)
    _title(axis, "Does the error of rigid body and friction repeat?")


def _number(axis: Axes, row: int, start: float, share: float, part: str) -> None:
    axis.text(
        start + 0.5 * share,
        row,
        f"{share:.0%}",
        ha="center",
        va="center",
        fontsize=8,
        color="black" if part in ("noise", "wanders") else "white",
        zorder=3,
        bbox={"facecolor": COLOURS[part], "edgecolor": "none", "pad": 1},
    )


def _dependence(axis: Axes, verdict: Verdict) -> None:
    """Draw a field for each joint and variable: the share of the error that its curve predicts."""
    ranked = {
        joint: {one.variable: one.share_before for one in ranking}
        for joint, ranking in verdict.depends_on.items()
    }
    variables = _variables(ranked)
    # A joint may lack a variable, such as a temperature.
    shares = np.array([[of.get(name, np.nan) for name in variables] for of in ranked.values()])
    shades = LinearSegmentedColormap.from_list("shares", ["#ffffff", BLUE])
    axis.imshow(shares, cmap=shades, vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = "–" if np.isnan(share) else f"{share:.0%}"
        colour = "white" if share > 0.5 else "black"
        axis.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    # Long names need two lines.
    words = [
        "accel-\neration" if name == "acceleration" else name.replace("_", "\n")
        for name in variables
    ]
    axis.set_xticks(range(len(variables)), words, fontsize=8)
    axis.set_yticks(range(len(ranked)), list(ranked))
    axis.grid(visible=False)
    axis.tick_params(length=0)
    for spine in axis.spines.values():
        spine.set_visible(False)
    axis.set_xlabel("share that a curve of it alone predicts, validation runs", fontsize=8)
    _title(axis, "What does it depend on?")


def _variables(ranked: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return the usual variables, and others that predict enough, without the phase."""
    every = dict.fromkeys(name for of in ranked.values() for name in of if name != "phase")
    most = {name: max(of.get(name, 0.0) for of in ranked.values()) for name in every}
    usual = [name for name in VARIABLES if name in every]
    others = [name for name in every if name not in usual and most[name] >= 0.05]
    return usual + sorted(others, key=lambda name: -most[name])[:3]


@dataclass(frozen=True)
class Bar:
    """A set of causes and laws, or several that share a bar."""

    probability: float
    elements: tuple[tuple[str, str | None, bool, bool], ...]
    """Words, family, whether unlisted, and whether an answer, of each element."""


def _bars(d: Diagnosis) -> list[Bar]:
    """Return the most probable sets, the others together last."""
    weighed = d.selected.posterior
    if weighed is None:
        return []
    ranked = sorted(weighed.by_labels.items(), key=lambda item: -item[1])
    # Largest number of sets in the figure, and the least probability of one: the others share one
    # bar.
    most, least = 6, 0.01
    shown = [(labels, p) for labels, p in ranked[:most] if p >= least]
    bars = [Bar(p, tuple(_elements(d, labels))) for labels, p in shown]
    rest = 1.0 - sum(p for _, p in shown)
    # A smaller rest reads as 0.00.
    if rest >= 0.5 * least:
        others = ranked[len(shown) :]
        words = f"{len(others)} other set{'s' * (len(others) > 1)}"
        if (
            shown
            and shown[0][0]
            # A set that contains the first one agrees with it on these causes.
            and 2.0 * sum(p for labels, p in others if labels > shown[0][0]) > rest
        ):
            words += ", mostly the first with a further cause or law"
        bars.append(Bar(rest, ((_in_lines(words), None, False, False),)))
    return bars


def _elements(d: Diagnosis, labels: frozenset[str]) -> Iterator[tuple[str, str | None, bool, bool]]:
    weighed = d.selected.posterior
    if not labels or weighed is None:
        yield "nothing is missing", None, False, d.status == "nothing_missing"
    answers = {label for one in d.named for label in (one.element.label, *dict(one.ties))}
    against = d.selected.dropped
    # Listed causes come before laws.
    for label in sorted(labels, key=lambda one: (one.startswith(LAW), one)):
        assert weighed is not None
        words = label_in_words(label, d.baseline.machine)
        words += " (validation runs against it)" * (label in against)
        family, unlisted = family_of(label, weighed), label.startswith(LAW)
        yield _in_lines(words), family, unlisted, label in answers


def _in_lines(words: str) -> str:
    """Break a label into lines that leave room for the bars."""
    return fill(words, 34)


def _height(bar: Bar) -> float:
    """Return the number of lines of a bar, with the gap below it."""
    return sum(1.3 + words.count("\n") for words, *_ in bar.elements) + 0.6


def _sets(axis: Axes, bars: list[Bar]) -> None:
    """Draw a bar for each set, with a stripe for each of its elements."""
    _title(axis, "What explains it?")
    if not bars:
        axis.text(0.0, 0.9, "not searched: acquisition is at fault", transform=axis.transAxes)
        axis.set_axis_off()
        return
    ticks, families, top = [], dict[str, Patch](), 0.0
    of_unlisted = "////"
    for bar in bars:
        begin = top
        for words, family, unlisted, named in bar.elements:
            height = 1.3 + words.count("\n")
            colour = FAMILIES.get(str(family), GREY)
            style: dict[str, Any] = {"color": colour, "edgecolor": "white", "lw": 0.8}
            hatch, y = of_unlisted if unlisted else None, top + 0.5 * height
            axis.barh(y, bar.probability, height, hatch=hatch, **style)
            ticks.append((y, words, named))
            if family:
                families[family] = Patch(color=colour)
            top += height
        middle = 0.5 * (begin + top)
        axis.text(bar.probability + 0.015, middle, f"{bar.probability:.2f}", va="center")
        top += 0.6
    axis.set_yticks([y for y, *_ in ticks], [words for _, words, _ in ticks], fontsize=8)
    for label, (*_, named) in zip(axis.get_yticklabels(), ticks, strict=True):
        label.set_fontweight("bold" if named else "normal")
    # Without a least number of lines, few bars fill the axis.
    axis.set_ylim(max(top, 17), -0.4)
    # Beyond 1 there is only the number of a long bar.
    axis.set_xlim(0.0, 1.1)
    axis.set_xticks(np.linspace(0.0, 1.0, 6))
    axis.spines["bottom"].set_bounds(0.0, 1.0)
    axis.grid(axis="y", visible=False)
    axis.set_axisbelow(True)
    axis.tick_params(axis="y", length=0)
    axis.set_xlabel(
        "probability of each set of causes and laws; a cause's own is the sum over its sets\n"
        "bold: named, or tied with it",
        fontsize=8,
    )
    if any(unlisted for bar in bars for _, _, unlisted, _ in bar.elements):
        families["unlisted law"] = Patch(facecolor=GREY, hatch=of_unlisted, edgecolor="white")
    legend_below(axis, families, 0.17, 4)


def _title(axis: Axes, words: str) -> None:
    axis.set_title(words, loc="left", fontsize=10, fontweight="bold")
