"""Draw the residual against the variables of the runs, the most predictive first."""

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipelines.contracts.verdict import Dependence, Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures.against import against, draw, reach
from pipelines.plotting.style import BLUE, GREY


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw a row for each joint and a column for each rank."""
    ranked = {joint: _shown(ranking) for joint, ranking in verdict.depends_on.items()}
    columns = max(len(ranking) for ranking in ranked.values())
    drawn, axes = plt.subplots(
        len(ranked),
        columns,
        figsize=(2.2 * columns, 2.5 * len(ranked) + 0.3),
        squeeze=False,
        sharey="row",
    )
    for j, (row, (joint, ranking)) in enumerate(zip(axes, ranked.items(), strict=True)):
        seen = [against(one.variable, d, joint, verdict.runs) for one in ranking]
        height = max(reach(s.before, s.after) for s in seen)
        # A joint with fewer variables leaves axes over, which are switched off.
        for axis, one, values in zip(row, ranking, seen, strict=False):
            draw(axis, values, float(d.floor.rms[j]), height, bool(d.causes))
            after = f" → {one.share_after:.0%}" if d.causes else ""
            axis.set_title(f"{one.share_before:.0%}{after}", fontsize=8)
        for axis in row[len(ranking) :]:
            axis.set_axis_off()
        row[0].set_ylabel(f"{joint} residual, {verdict.units[joint]['torque']}")
    names = ["before"] + ["after"] * bool(d.causes)
    lines = [Line2D([], [], color=colour, lw=1.8) for colour in (GREY, BLUE)]
    drawn.legend(lines[: len(names)], names, loc="upper right", ncols=2)
    drawn.suptitle(
        "What the torque error depends on, most first; the phase of the period last",
        x=0.01,
        ha="left",
        fontweight="bold",
    )
    explained = (
        "%: share of the error's variance that a curve predicts. Band: noise floor. Dashed:"
        " backward, or another run."
    )
    drawn.text(0.01, 0.925, explained, fontsize=8.5, va="top")
    drawn.tight_layout(rect=(0, 0, 1, 0.94))
    return drawn


def _shown(ranking: list[Dependence]) -> list[Dependence]:
    """Return the variables to draw, the phase last: it can imitate everything that repeats."""
    # Variables that are always shown; others only where they predict something.
    always_shown = ("angle", "speed", "load", "time", "phase")
    chosen = [one for one in ranking if one.share_before > 0.05 or one.variable in always_shown]
    phase = [one for one in chosen if one.variable == "phase"]
    others = [one for one in chosen if one.variable != "phase"]
    return sorted(others, key=lambda one: -one.share_before)[:6] + phase
