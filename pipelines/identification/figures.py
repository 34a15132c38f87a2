"""The figures of an identification: what the model predicts, and what is left."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipelines.contracts.joints import Joint
from pipelines.plots import BLUE as LEFT
from pipelines.plots import GREY as MEASURED
from pipelines.plots import ORANGE as PREDICTED
from pipelines.plots import STYLE, save

BINS, FEWEST = 25, 8
"""Of the running mean of a residual, and the samples a bin needs to have one."""


def draw(residuals: pd.DataFrame, joints: tuple[Joint, ...], folder: Path) -> None:
    """Write the figures of every validation run as PNG and PDF into a folder.

    ``residuals`` is a ``residuals/1`` table.
    """
    with plt.rc_context(STYLE):
        for name, run in residuals[residuals["purpose"] == "validate"].groupby("file", sort=False):
            stem = Path(str(name)).stem
            save(_prediction(run, joints, stem), folder / f"torque-{stem}")
            save(_what_is_left(run, joints, stem), folder / f"residual-{stem}")


def _prediction(run: pd.DataFrame, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw measured and predicted torque over time, the difference on the same scale beneath."""
    figure, axes = plt.subplots(
        2 * len(joints), 1, figsize=(9, 3.2 * len(joints)), sharex=True, height_ratios=[3, 1.3] * len(joints)
    )
    for j, joint in enumerate(joints):
        torque, left = axes[2 * j], axes[2 * j + 1]
        torque.plot(run["time_s"], run[joint.column("torque")], color=MEASURED, lw=2.2, label="measured")
        torque.plot(run["time_s"], run[joint.column("predicted")], color=PREDICTED, lw=0.9, label="predicted")
        torque.set_ylabel(f"{joint.name} torque, {joint.unit('torque')}")
        torque.set_title(f"{joint.name}: {_error(run, joint)}", loc="left", fontsize=9)
        _residual_over(left, run["time_s"], run, joint)
        left.set_ylabel(f"left, {joint.unit('torque')}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=2)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{title}: torque no fit has seen", x=0.02, ha="left", fontweight="bold")
    figure.align_ylabels()
    figure.tight_layout()
    return figure


def _what_is_left(run: pd.DataFrame, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw the residual against time, angle and speed: noise has no shape in any of them."""
    figure, axes = plt.subplots(len(joints), 3, figsize=(10, 2.7 * len(joints)), squeeze=False, sharey="row")
    for row, joint in zip(axes, joints, strict=True):
        against = {"time, s": "time_s"}
        against |= {f"{joint.name} {q}, {joint.unit(q)}": joint.column(q) for q in ("angle", "velocity")}
        for axis, (label, column) in zip(row, against.items(), strict=True):
            _residual_over(axis, run[column], run, joint, dots=True)
            axis.set_xlabel(label)
        row[0].set_ylabel(f"{joint.name} residual, {joint.unit('torque')}")
        row[0].set_title(_error(run, joint), loc="left", fontsize=9)
    figure.legend(*axes[0, -1].get_legend_handles_labels(), loc="upper right", ncols=3, markerscale=4)
    figure.suptitle(f"{title}: what the model leaves", x=0.02, ha="left", fontweight="bold")
    figure.tight_layout()
    return figure


def _residual_over(axis: Axes, x: pd.Series, run: pd.DataFrame, joint: Joint, dots: bool = False) -> None:
    residual, scored = run[joint.column("residual")].to_numpy(), run["scored"].to_numpy()
    if not dots:
        axis.plot(x, np.where(scored, residual, np.nan), color=LEFT, lw=0.7)
        return
    axis.plot(x[~scored], residual[~scored], ".", ms=1.2, color=MEASURED, alpha=0.5, label="near a reversal")
    axis.plot(x[scored], residual[scored], ".", ms=1.2, color=LEFT, alpha=0.6, label="scored")
    bins = run.loc[scored].groupby(pd.cut(x[scored], BINS), observed=False)[joint.column("residual")]
    mean = bins.mean().where(bins.count() >= FEWEST)
    axis.plot([b.mid for b in mean.index], mean, color=PREDICTED, lw=1.6, label="mean")
    axis.axhline(0, color="black", lw=0.6)
    # A joint that sticks leaves errors ten times the rest, which would flatten what there is to see.
    height = 6 * residual[scored].std()
    axis.set_ylim(-height, height)


def _error(run: pd.DataFrame, joint: Joint) -> str:
    scored = run[run["scored"]]
    residual, torque = (np.sqrt(np.mean(scored[joint.column(name)] ** 2)) for name in ("residual", "torque"))
    return f"RMSE {residual:.2f} of {torque:.1f} {joint.unit('torque')} rms"
