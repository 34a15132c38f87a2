"""The figures of an identification: what the model predicts, and what is left."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Rows
from pipelines.plotting.style import BLUE as LEFT
from pipelines.plotting.style import GREY as MEASURED
from pipelines.plotting.style import ORANGE as PREDICTED
from pipelines.plotting.style import STYLE, save

BINS, FEWEST = 25, 8
"""Of the running mean of a residual, and the samples a bin needs to have one."""


MOST = 20_000
"""Rows of a run that are drawn; of a longer one every second, fourth, ..."""


@dataclass
class _Drawn:
    """What is drawn of one run, and what is said of all of it."""

    frame: pd.DataFrame
    every: int = 1
    passed: int = 0
    scored: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    """Of each column, over the scored rows."""

    def add(self, frame: pd.DataFrame, columns: Sequence[str]) -> None:
        scored = frame[frame["scored"]]
        self.scored += len(scored)
        for name in columns:
            self.squares[name] = self.squares.get(name, 0.0) + float(np.sum(scored[name] ** 2))
        chosen = frame.iloc[-self.passed % self.every :: self.every]
        self.frame = (
            pd.concat([self.frame, chosen], ignore_index=True) if len(self.frame) else chosen
        )
        self.passed += len(frame)
        while len(self.frame) > MOST:
            self.frame = self.frame.iloc[::2].reset_index(drop=True)
            self.every *= 2

    def rms(self, column: str) -> float:
        return float(np.sqrt(self.squares[column] / self.scored)) if self.scored else np.nan


def draw(residuals: Rows, folder: Path) -> None:
    """Write the figures of every validation run as PNG and PDF into a folder.

    ``residuals`` is a ``residuals/1`` table.
    """
    joints = residuals.joints
    with plt.rc_context(STYLE):
        for name, run in _validation_runs(residuals).items():
            stem = Path(name).stem
            save(_prediction(run, joints, stem), folder / f"torque-{stem}")
            save(_what_is_left(run, joints, stem), folder / f"residual-{stem}")


def _validation_runs(residuals: Rows) -> dict[str, _Drawn]:
    columns = [
        joint.column(quantity) for joint in residuals.joints for quantity in ("residual", "torque")
    ]
    runs: dict[str, _Drawn] = {}
    for piece in residuals.pieces():
        frame = piece.to_pandas()
        for name, rows in frame[frame["purpose"] == "validate"].groupby("file", sort=False):
            runs.setdefault(str(name), _Drawn(rows.iloc[:0])).add(rows, columns)
    return runs


def _prediction(drawn: _Drawn, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw measured and predicted torque over time, the difference on the same scale beneath."""
    run = drawn.frame
    figure, axes = plt.subplots(
        2 * len(joints),
        1,
        figsize=(9, 3.2 * len(joints)),
        sharex=True,
        height_ratios=[3, 1.3] * len(joints),
    )
    for j, joint in enumerate(joints):
        torque, residual = axes[2 * j], axes[2 * j + 1]
        torque.plot(
            run["time_s"], run[joint.column("torque")], color=MEASURED, lw=2.2, label="measured"
        )
        torque.plot(
            run["time_s"],
            run[joint.column("predicted")],
            color=PREDICTED,
            lw=0.9,
            label="predicted",
        )
        torque.set_ylabel(f"{joint.name} torque, {joint.unit('torque')}")
        torque.set_title(f"{joint.name}: {_error(drawn, joint)}", loc="left", fontsize=9)
        _residual_over(residual, run["time_s"], run, joint)
        residual.set_ylabel(f"left, {joint.unit('torque')}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=2)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{title}: torque no fit has seen", x=0.02, ha="left", fontweight="bold")
    figure.align_ylabels()
    figure.tight_layout()
    return figure


def _what_is_left(drawn: _Drawn, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw the residual against time, angle and speed: noise has no shape in any of them."""
    run = drawn.frame
    figure, axes = plt.subplots(
        len(joints), 3, figsize=(10, 2.7 * len(joints)), squeeze=False, sharey="row"
    )
    for row, joint in zip(axes, joints, strict=True):
        against = {"time, s": "time_s"}
        against |= {
            f"{joint.name} {q}, {joint.unit(q)}": joint.column(q) for q in ("angle", "velocity")
        }
        for axis, (label, column) in zip(row, against.items(), strict=True):
            _residual_over(axis, run[column], run, joint, dots=True)
            axis.set_xlabel(label)
        row[0].set_ylabel(f"{joint.name} residual, {joint.unit('torque')}")
        row[0].set_title(_error(drawn, joint), loc="left", fontsize=9)
    figure.legend(
        *axes[0, -1].get_legend_handles_labels(), loc="upper right", ncols=3, markerscale=4
    )
    figure.suptitle(f"{title}: what the model leaves", x=0.02, ha="left", fontweight="bold")
    figure.tight_layout()
    return figure


def _residual_over(
    axis: Axes, x: pd.Series, run: pd.DataFrame, joint: Joint, dots: bool = False
) -> None:
    residual, scored = run[joint.column("residual")].to_numpy(), run["scored"].to_numpy()
    if not dots:
        axis.plot(x, np.where(scored, residual, np.nan), color=LEFT, lw=0.7)
        return
    axis.plot(
        x[~scored],
        residual[~scored],
        ".",
        ms=1.2,
        color=MEASURED,
        alpha=0.5,
        label="near a reversal",
    )
    axis.plot(x[scored], residual[scored], ".", ms=1.2, color=LEFT, alpha=0.6, label="scored")
    axis.axhline(0, color="black", lw=0.6)
    if not scored.any():
        return
    bins = run.loc[scored].groupby(pd.cut(x[scored], BINS), observed=False)[
        joint.column("residual")
    ]
    mean = bins.mean().where(bins.count() >= FEWEST)
    axis.plot([b.mid for b in mean.index], mean, color=PREDICTED, lw=1.6, label="mean")
    # A joint that sticks leaves errors ten times the rest, which would flatten what there is to
    # see.
    height = 6 * residual[scored].std()
    if height > 0.0:
        axis.set_ylim(-height, height)


def _error(drawn: _Drawn, joint: Joint) -> str:
    if not drawn.scored:
        return "no sample away from reversals to score"
    residual, torque = (drawn.rms(joint.column(name)) for name in ("residual", "torque"))
    return f"RMSE {residual:.2f} of {torque:.1f} {joint.unit('torque')} rms"
