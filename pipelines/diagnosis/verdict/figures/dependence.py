"""The residual against everything that the runs know, most telling first."""

from typing import Any

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures.against import against, draw, reach
from pipelines.diagnosis.verdict.figures.palette import AFTER, BEFORE

SHOWN = ("angle", "speed", "acceleration", "load", "time", "phase", "cuff_force")
"""Always; another variable only where it foretells something."""
SOMETHING = 0.05


def figure(d: Diagnosis, said: dict[str, Any]) -> Figure:
    """Draw a row for each joint and a column for each rank."""
    ranked = {joint: _shown(ranking) for joint, ranking in said["depends_on"].items()}
    columns = max(len(ranking) for ranking in ranked.values())
    drawn, axes = plt.subplots(
        len(ranked), columns, figsize=(2.2 * columns, 2.5 * len(ranked)), squeeze=False, sharey="row"
    )
    for j, (row, (joint, ranking)) in enumerate(zip(axes, ranked.items(), strict=True)):
        seen = [against(one["variable"], d, joint, said["runs"]) for one in ranking]
        height = max(reach(s.before, s.after) for s in seen)
        for axis, one, values in zip(row, ranking, seen, strict=False):
            draw(axis, values, float(d.floor.rms[j]), height, bool(d.causes))
            axis.set_title(_foretold(one, bool(d.causes)), fontsize=8)
        for axis in row[len(ranking) :]:
            axis.set_axis_off()
        row[0].set_ylabel(f"{joint} residual, {said['units'][joint]['torque']}")
    names = ["before"] + ["after"] * bool(d.causes)
    lines = [Line2D([], [], color=colour, lw=1.8) for colour in (BEFORE, AFTER)]
    drawn.legend(lines[: len(names)], names, loc="upper right", ncols=2)
    drawn.suptitle(
        "What the torque error goes with, most first, the phase of the period last:\n"
        "share of its variance that a curve foretells (band: noise floor; dashed: backward, or another run)",
        x=0.01, ha="left", fontweight="bold",
    )  # fmt: skip
    drawn.tight_layout()
    return drawn


def _shown(ranking: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return what is drawn, the phase last: it can imitate whatever repeats, and says only that something does."""
    chosen = [one for one in ranking if one["share_before"] > SOMETHING or one["variable"] in SHOWN]
    return sorted(chosen, key=lambda one: one["variable"] == "phase")


def _foretold(one: dict[str, Any], changed: bool) -> str:
    return f"{one['share_before']:.0%}" + (f" → {one['share_after']:.0%}" if changed else "")
