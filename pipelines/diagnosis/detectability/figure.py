"""Draw the smallest torque of each cause that is detected, joint by joint."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from pipelines.diagnosis.detectability.detectability import Detectable
from pipelines.plotting.style import BLUE, GREY, ORANGE, STYLE, save
from pipelines.wording.label import effect_labelled, title_in_words


def draw(results: Sequence[Detectable], stem: Path, title: str) -> None:
    """Write the bars as PNG and PDF; a cause of the whole leg is drawn with the hip."""
    joints = list(dict.fromkeys(one.effect.joint for one in results if one.effect.joint))
    groups = [[one for one in results if (one.effect.joint or joints[0]) == j] for j in joints]
    height = 0.9 + 0.22 * max(len(group) for group in groups)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            1, len(joints), figsize=(5.8 * len(joints), height), sharex=True, squeeze=False
        )
        for axis, joint, group in zip(axes[0], joints, groups, strict=True):
            _bars(
                axis, joint, sorted(group, key=lambda one: (one.smallest_rms_nm, one.effect.name))
            )
        figure.suptitle(title, x=0.02, ha="left", fontweight="bold")
        figure.tight_layout()
        save(figure, stem)


def _bars(axis: Axes, joint: str, group: list[Detectable]) -> None:
    limit = group[0].torque_rms_nm
    rows = np.arange(len(group))
    # A cause that is never detected has an infinite size; its bar ends at the joint's torque.
    widths = [min(one.smallest_rms_nm, limit) for one in group]
    colors = [BLUE if _seen(one) else GREY for one in group]
    axis.barh(rows, widths, color=colors, height=0.7)
    for row, width, one in zip(rows, widths, group, strict=True):
        if one.best_rms_nm < 0.98 * width:
            axis.plot(one.best_rms_nm, row, "|", color="white", ms=9, mew=1.5)
        axis.annotate(
            _note(one),
            (width, row),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=7,
            bbox={"fc": "white", "ec": "none", "pad": 0.6},
        )
    axis.set_yticks(rows, [_name(one) for one in group])
    axis.invert_yaxis()
    axis.set_xscale("log")
    # Room for the notes to the right of the longest bar.
    least = 0.1 if group[0].effect.on.is_exoskeleton else 0.005 * limit
    axis.set_xlim(0.6 * min(min(one.best_rms_nm for one in group), least), 30 * limit)
    axis.axvline(limit, color=ORANGE, lw=1)
    axis.annotate(
        "the joint's own torque",
        (limit, -0.8),
        fontsize=7,
        color=ORANGE,
        ha="center",
        va="bottom",
        annotation_clip=False,
    )
    axis.grid(axis="y", visible=False)
    axis.set_xlabel(
        f"smallest detectable effect, {group[0].unit} rms (white tick: at its best shape)"
    )
    axis.set_title(joint, loc="left")


def _seen(one: Detectable) -> bool:
    return one.smallest_rms_nm < one.torque_rms_nm


def _name(one: Detectable) -> str:
    return one.effect.title if one.effect.joint else f"{one.effect.title} (whole leg)"


def _note(one: Detectable) -> str:
    if not _seen(one):
        return "not detectable"
    ties = ", ".join(_short(label, one.effect.joint) for label in one.tied_with[:2])
    more = f" +{len(one.tied_with) - 2}" if len(one.tied_with) > 2 else ""
    return one.size_in_words() + (f"  or {ties}{more}" if ties else "")


def _short(label: str, joint: str | None) -> str:
    effect = effect_labelled(label)
    title = title_in_words(effect)
    return title if effect.joint in (None, joint) else f"{title} ({effect.joint})"
