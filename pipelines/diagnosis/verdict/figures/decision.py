"""The first figure: how each joint's residual repeats, and how probable each explanation is."""

from typing import Any

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pipelines.contracts.joints import the
from pipelines.diagnosis.candidates.smooth_laws import IN_WORDS
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.label import effect_labelled, in_words
from pipelines.plots import BLUE, CAUSES, GREY, NOISE, WANDERS

PARTS = {
    "noise": ("noise", NOISE),
    "wanders": ("wanders from period to period", WANDERS),
    "between_runs": ("differs between runs", CAUSES[1]),
    "repeats": ("repeats with the motion", BLUE),
    "unsplit": ("more than noise; no period tells whether it repeats", GREY),
}
"""Shares of the residual, in words, and their colours."""
SHOWN = 8
"""Sets of causes and laws in the figure."""
TEXT = 0.08
"""Share of a bar in which its number fits."""


def figure(d: Diagnosis, said: dict[str, Any]) -> Figure:
    """Draw the residual's shares on the left, and the posterior over sets on the right."""
    drawn, (left, right) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=[1, 1.1])
    _shares(left, said)
    _sets(right, d)
    drawn.tight_layout()
    return drawn


def _shares(axis: Axes, said: dict[str, Any]) -> None:
    joints = list(said["router"])
    seen: dict[str, Patch] = {}
    for row, joint in enumerate(joints):
        start = 0.0
        for part, (words, colour) in PARTS.items():
            share = said["router"][joint][part] or 0.0
            if share <= 0.0:
                continue
            axis.barh(row, share, left=start, color=colour, height=0.6, edgecolor="white", lw=0.5)
            if share > TEXT:
                dark = part in ("repeats", "unsplit")
                axis.text(
                    start + 0.5 * share, row, f"{share:.0%}", ha="center", va="center", fontsize=8,
                    color="white" if dark else "black",
                )  # fmt: skip
            seen.setdefault(words, Patch(color=colour))
            start += share
    units = {joint: of["torque"] for joint, of in said["units"].items()}
    names = [f"{j}\n{said['router'][j]['rms_nm']:.3g} {units[j]} rms" for j in joints]
    axis.set_yticks(range(len(joints)), names)
    axis.set_ylim(len(joints) - 0.5, -0.5)
    axis.set_xlim(0.0, 1.0)
    axis.set_xlabel("share of the baseline residual's mean square (0.1 s averages)")
    axis.legend(
        seen.values(), seen.keys(), loc="upper left", bbox_to_anchor=(-0.02, -0.18), fontsize=8,
        ncols=2,
    )  # fmt: skip
    axis.set_title("Does the residual repeat?", loc="left", fontweight="bold")


def _sets(axis: Axes, d: Diagnosis) -> None:
    axis.set_title("What explains it?", loc="left", fontweight="bold")
    if d.selected.posterior is None:
        axis.text(0.0, 0.5, "not asked: acquisition is at fault", transform=axis.transAxes)
        axis.set_axis_off()
        return
    ranked = sorted(d.selected.posterior.by_labels.items(), key=lambda item: -item[1])[:SHOWN]
    named = frozenset(d.causes)
    for row, (labels, p) in enumerate(ranked):
        colour = CAUSES[0] if labels == named else GREY
        axis.barh(row, p, color=colour, height=0.65)
        axis.text(p + 0.01, row, f"{p:.2f}" if p >= 0.005 else f"{p:.0e}", va="center", fontsize=8)
    axis.set_yticks(range(len(ranked)), [_in_words(labels) for labels, _ in ranked], fontsize=8)
    axis.set_ylim(len(ranked) - 0.5, -0.5)
    axis.set_xlim(0.0, 1.12)
    axis.set_xlabel("probability of each set of causes and unlisted laws")


def _in_words(labels: frozenset[str]) -> str:
    return " +\n".join(_label_in_words(label) for label in sorted(labels)) or "nothing is missing"


def _label_in_words(label: str) -> str:
    if not label.startswith("law:"):
        return in_words(effect_labelled(label))
    kind, _, joint = label.removeprefix("law:").partition("@")
    return IN_WORDS[kind].format(joint=the(joint))
