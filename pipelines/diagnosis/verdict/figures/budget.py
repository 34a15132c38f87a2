"""Draw the error budget: a bar for each joint, as long as its mean square error, in shares."""

from collections.abc import Mapping

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures.shared import heading
from pipelines.plotting.style import BLUE, CAUSES, NOISE, WANDERS
from pipelines.wording.label import SHARES, in_words


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw a bar for each joint, next to it every share in N·m, at a prismatic joint in N."""
    budget = verdict.error_budget
    units = {joint: of["torque"] for joint, of in verdict.units.items()}
    drawn, axes = plt.subplots(len(budget), 1, figsize=(9, 0.6 + 1.5 * len(budget)), squeeze=False)
    colours = colours_of(budget)
    for axis, (joint, shares) in zip(axes[:, 0], budget.items(), strict=True):
        total = sum(shares.values())
        stack(axis, 0.0, shares, colours)
        axis.set_yticks([])
        axis.set_xlim(min(lowest(shares), 0.0) * 1.05, 1.02 * highest(shares))
        axis.set_title(
            f"{joint}: {rms(total)} {units[joint]} rms with rigid body and friction",
            loc="left",
            fontsize=9,
        )
        axis.legend(
            [Patch(color=colours[key]) for key in shares],
            [_line(words_of(key, d), share, total, units[joint]) for key, share in shares.items()],
            loc="center left",
            bbox_to_anchor=(1.01, 0.5),
        )
    last = d.baseline.machine.joints[-1]
    axes[-1, 0].set_xlabel(
        f"mean square of the {last.effort} error on data no fit has seen, ({last.unit('torque')})²"
    )
    heading(drawn, "What the error is made of")
    drawn.tight_layout()
    return drawn


def colours_of(budget: Mapping[str, Mapping[str, float]]) -> dict[str, str]:
    """Return the colour of every share."""
    of_no_cause = {
        "noise_floor": NOISE,
        "repeatable_unexplained": BLUE,
        "not_repeatable": WANDERS,
        "unexplained": BLUE,
    }
    labels = [key for key in next(iter(budget.values())) if key not in of_no_cause]
    # There are as many colours as causes in the largest set.
    return of_no_cause | dict(zip(labels, CAUSES, strict=False))


def words_of(key: str, d: Diagnosis) -> str:
    """Return a share's name in words."""
    return SHARES.get(key) or in_words(d.effects[key])


def stack(
    axis: Axes,
    row: float,
    shares: Mapping[str, float],
    colours: Mapping[str, str],
    scale: float = 1.0,
) -> None:
    """Draw the shares end to end; negative ones, of causes that raise an error, go to the left.

    Parameters
    ----------
    axis : Axes
        Where to draw.
    row : float
        Height of the bar.
    shares : mapping
        Mean squares by share, (N·m)².
    colours : mapping
        Colour by share.
    scale : float, optional
        Length of the bar per (N·m)².
    """
    right = left = 0.0
    whole = highest(shares) * scale
    for key, share in shares.items():
        width = share * scale
        # A cause that raises the error must not shorten the bars of the others.
        start = right if width >= 0 else left
        axis.barh(row, width, left=start, color=colours[key], height=0.7, edgecolor="white", lw=0.5)
        if abs(width) > 0.07 * whole:  # its number fits in it
            axis.text(
                start + 0.5 * width,
                row,
                rms(share),
                ha="center",
                va="center",
                fontsize=8,
                color="black" if key in ("noise_floor", "not_repeatable") else "white",
            )
        right, left = (right + width, left) if width >= 0 else (right, left + width)
    axis.grid(axis="y", visible=False)


def highest(shares: Mapping[str, float]) -> float:
    """Return the length of a bar to the right."""
    return sum(share for share in shares.values() if share > 0)


def lowest(shares: Mapping[str, float]) -> float:
    """Return the length of a bar to the left of zero."""
    return sum(share for share in shares.values() if share < 0)


def rms(share: float) -> str:
    """Return a mean square as root mean square.

    Parameters
    ----------
    share : float
        (N·m)²; a negative one gets a minus sign.

    Returns
    -------
    str
        N·m.
    """
    root, sign = np.sqrt(abs(share)), "−" if share < 0 else ""
    # Of a small number two decimals would be one digit or none.
    return f"{sign}{root:.2f}" if root > 0.095 else f"{sign}{root:.2g}"


def _line(words: str, share: float, total: float, unit: str) -> str:
    if abs(share) < 0.005 * total:
        return f"{words}: none"
    worse = "makes it worse by " if share < 0 else ""
    return f"{words}: {worse}{rms(abs(share))} {unit} rms, {abs(share) / total:.0%} of the square"
