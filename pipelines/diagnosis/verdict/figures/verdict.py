"""Draw the figure of the summary: parts of the torque error, and the effect of the causes."""

import textwrap

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.dependence.explained_share import VARIABLES, knows, tone, variable_share
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures.against import against, draw, reach
from pipelines.diagnosis.verdict.figures.budget import (
    colours_of,
    highest,
    lowest,
    rms,
    stack,
    words_of,
)
from pipelines.diagnosis.verdict.figures.shared import legend_below
from pipelines.effects import RUNS
from pipelines.model import effect_named
from pipelines.plotting.style import BLUE, GREY, NOISE
from pipelines.wording.label import in_words


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw the error budget, and the residual against the variable that shows the cause best."""
    summary = textwrap.wrap(verdict.summary, 125)
    # Heights of the summary's lines, and of the panels below them, inches.
    head = 0.1 + 0.19 * len(summary)
    height = head + 3.5
    drawn, (left, right) = plt.subplots(1, 2, figsize=(10, height), width_ratios=[1, 1.1])
    _budget(left, d, verdict)
    _shape(right, d, verdict)
    drawn.text(0.01, 1.0, "\n".join(summary), ha="left", va="top", fontsize=9.5, fontweight="bold")
    drawn.tight_layout(rect=(0, 0, 1, 1 - head / height))
    return drawn


def _budget(axis: Axes, d: Diagnosis, verdict: Verdict) -> None:
    """Draw each joint's bar to its own scale: its baseline's mean square is 100 %."""
    budget = verdict.error_budget
    colours = colours_of(budget)
    totals = {joint: sum(shares.values()) for joint, shares in budget.items()}
    for row, (joint, shares) in enumerate(budget.items()):
        stack(axis, row, shares, colours, scale=100.0 / totals[joint])
    axis.set_yticks(
        range(len(budget)),
        [
            f"{joint}\n{rms(total)} {verdict.units[joint]['torque']}"
            for joint, total in totals.items()
        ],
        fontsize=9,
    )
    axis.set_ylim(len(budget) - 0.5, -0.5)
    ends = [
        (lowest(shares) * 100 / totals[joint], highest(shares) * 100 / totals[joint])
        for joint, shares in budget.items()
    ]
    axis.set_xlim(min(low for low, _ in ends), max(high for _, high in ends))
    units = " and ".join(dict.fromkeys(of["torque"] for of in verdict.units.values()))
    axis.set_xlabel(f"share of the mean square error, %; numbers: {units} rms")
    there = [
        key
        for key in next(iter(budget.values()))
        if any(abs(shares[key]) > 0.01 * totals[joint] for joint, shares in budget.items())
    ]
    legend_below(axis, {words_of(key, d): Patch(color=colours[key]) for key in there}, 0.2, 2)


def _shape(axis: Axes, d: Diagnosis, verdict: Verdict) -> None:
    """Draw the residual where the first cause, or the unexplained part, shows best."""
    if d.causes:
        joint, variable, kinds = _shown_best(d, verdict)
    else:
        joint = max(
            verdict.noise_floor_nm,
            key=lambda j: verdict.baseline_rmse_nm[j] / verdict.noise_floor_nm[j],
        )
        # The time at which a fault of acquisition begins is its best description.
        variable = "time" if d.data.spoilt else verdict.depends_on[joint][0].variable
        kinds = RUNS
    j = d.baseline.joints.index(joint)
    floor = float(d.floor.rms[j])
    seen = against(variable, d, joint, kinds)
    # With at least twice the floor in view, its band is seen as a band.
    draw(axis, seen, floor, max(reach(seen.before, seen.after), 2 * floor), bool(d.causes))
    axis.set_ylabel(
        f"{joint} {d.baseline.machine.joint(joint).effort} error, {verdict.units[joint]['torque']}"
    )
    named = " and ".join(in_words(d.effects[label]) for label in d.causes)
    colours = {"rigid body and friction": GREY} | ({f"with {named}": BLUE} if named else {})
    lines = {words: Line2D([], [], color=colour, lw=2) for words, colour in colours.items()}
    legend_below(axis, lines | {"noise floor": Patch(color=NOISE, alpha=0.5)}, 0.2)


def _shown_best(d: Diagnosis, verdict: Verdict) -> tuple[str, str, tuple[str, ...]]:
    """Return joint, variable and kinds of run that show the first cause's torque best."""
    first = verdict.causes[0]
    joint, effect = first.gain.joint, effect_named(first.effect)(joint=first.joint)
    # The difference of both residuals is the torque that the named causes explain.
    changes = [b - a for b, a in zip(d.before.residuals, d.after.residuals, strict=True)]
    shown = [i for i, run in enumerate(d.validate) if effect.explains(run.motion)]
    moved, by = [d.validate[i] for i in shown], [changes[i] for i in shown]
    j = d.baseline.joints.index(joint)
    # The phase imitates all that repeats, and so shows no cause.
    known = [v for v in VARIABLES if v.name != "phase" and knows(v, moved, j)]
    shares = {v.name: variable_share(v, moved, by, j) for v in known}
    shares["tone"] = tone(moved, by, j)[1]
    return joint, max(shares, key=lambda name: shares[name]), effect.acts_in
