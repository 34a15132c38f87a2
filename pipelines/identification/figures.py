"""The figures of an identification: predicted torque and residuals."""

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
from pipelines.plotting.style import BLUE as RESIDUAL
from pipelines.plotting.style import GREY as MEASURED
from pipelines.plotting.style import ORANGE as PREDICTED
from pipelines.plotting.style import STYLE, save

BINS = 25
"""Bins of the running mean of a residual."""
FEWEST = 8
"""Fewest samples of a bin with a mean."""
MOST = 20_000
"""Most rows drawn of a run; of a longer run every second, fourth, ... row is drawn."""


@dataclass
class _RunData:
    """The drawn rows of one run, and sums over all its rows."""

    frame: pd.DataFrame
    every: int = 1
    passed: int = 0
    scored: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    """Sum of squares of each column over the scored rows."""

    def add(self, frame: pd.DataFrame, columns: Sequence[str]) -> None:
        scored = frame[frame["scored"]]
        # The RMSE in a title is that of all rows, not of the rows that are drawn.
        self.scored += len(scored)
        for name in columns:
            self.squares[name] = self.squares.get(name, 0.0) + float(np.sum(scored[name] ** 2))
        # The first row of a piece completes the step that the piece before began.
        chosen = frame.iloc[-self.passed % self.every :: self.every]
        if len(self.frame):
            chosen = pd.concat([self.frame, chosen], ignore_index=True)
        self.frame = chosen
        self.passed += len(frame)
        # Every second row is dropped, so that those that stay are evenly spaced.
        while len(self.frame) > MOST:
            self.frame = self.frame.iloc[::2].reset_index(drop=True)
            self.every *= 2

    def rms(self, column: str) -> float:
        return float(np.sqrt(self.squares[column] / self.scored)) if self.scored else np.nan


def draw(residuals: Rows, folder: Path) -> None:
    """Write the figures of every validation run as PNG and PDF.

    Parameters
    ----------
    residuals : Rows
        A ``residuals/1`` table, N·m.
    folder : Path
        Where to write them.
    """
    joints = residuals.joints
    with plt.rc_context(STYLE):
        for name, run in _validation_runs(residuals).items():
            stem = Path(name).stem
            save(_prediction(run, joints, stem), folder / f"torque-{stem}")
            save(_residuals(run, joints, stem), folder / f"residual-{stem}")


def _validation_runs(residuals: Rows) -> dict[str, _RunData]:
    quantities = ("residual", "torque")
    columns = [joint.column(name) for joint in residuals.joints for name in quantities]
    runs: dict[str, _RunData] = {}
    for piece in residuals.pieces():
        frame = piece.to_pandas()
        for name, rows in frame[frame["purpose"] == "validate"].groupby("file", sort=False):
            runs.setdefault(str(name), _RunData(rows.iloc[:0])).add(rows, columns)
    return runs


def _prediction(run: _RunData, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw measured and predicted torque over time, with the residual on the same scale."""
    frame = run.frame
    size, heights = (9, 3.2 * len(joints)), [3, 1.3] * len(joints)
    figure, axes = plt.subplots(
        2 * len(joints), 1, figsize=size, sharex=True, height_ratios=heights
    )
    for j, joint in enumerate(joints):
        torque, residual = axes[2 * j], axes[2 * j + 1]
        time, measured = frame["time_s"], frame[joint.column("torque")]
        torque.plot(time, measured, color=MEASURED, lw=2.2, label="measured")
        predicted = frame[joint.column("predicted")]
        torque.plot(time, predicted, color=PREDICTED, lw=0.9, label="predicted")
        torque.set_ylabel(f"{joint.name} torque, {joint.unit('torque')}")
        torque.set_title(f"{joint.name}: {_error(run, joint)}", loc="left", fontsize=9)
        _residual_over(residual, time, frame, joint)
        residual.set_ylabel(f"residual, {joint.unit('torque')}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=2)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{title}: torque of a validation run", x=0.02, ha="left", fontweight="bold")
    figure.align_ylabels()
    figure.tight_layout()
    return figure


def _residuals(run: _RunData, joints: tuple[Joint, ...], title: str) -> Figure:
    """Draw the residual against time, angle and speed; noise shows no pattern in any of them."""
    frame = run.frame
    figure, axes = plt.subplots(
        len(joints), 3, figsize=(10, 2.7 * len(joints)), squeeze=False, sharey="row"
    )
    for row, joint in zip(axes, joints, strict=True):
        against = {"time, s": "time_s"}
        for quantity in ("angle", "velocity"):
            label = f"{joint.name} {quantity}, {joint.unit(quantity)}"
            against[label] = joint.column(quantity)
        for axis, (label, column) in zip(row, against.items(), strict=True):
            _residual_over(axis, frame[column], frame, joint, dots=True)
            axis.set_xlabel(label)
        row[0].set_ylabel(f"{joint.name} residual, {joint.unit('torque')}")
        row[0].set_title(_error(run, joint), loc="left", fontsize=9)
    figure.legend(
        *axes[0, -1].get_legend_handles_labels(), loc="upper right", ncols=3, markerscale=4
    )
    figure.suptitle(f"{title}: residual", x=0.02, ha="left", fontweight="bold")
    figure.tight_layout()
    return figure


def _residual_over(
    axis: Axes, x: pd.Series, frame: pd.DataFrame, joint: Joint, dots: bool = False
) -> None:
    residual, scored = frame[joint.column("residual")].to_numpy(), frame["scored"].to_numpy()
    if not dots:
        # NaN breaks the line near reversals, where sticking joints would set the scale.
        axis.plot(x, np.where(scored, residual, np.nan), color=RESIDUAL, lw=0.7)
        return
    left_out, label = ~scored, "near a reversal"
    axis.plot(x[left_out], residual[left_out], ".", ms=1.2, color=MEASURED, alpha=0.5, label=label)
    axis.plot(x[scored], residual[scored], ".", ms=1.2, color=RESIDUAL, alpha=0.6, label="scored")
    axis.axhline(0, color="black", lw=0.6)
    if not scored.any():
        return
    groups = frame.loc[scored].groupby(pd.cut(x[scored], BINS), observed=False)
    bins = groups[joint.column("residual")]
    mean = bins.mean().where(bins.count() >= FEWEST)
    axis.plot([b.mid for b in mean.index], mean, color=PREDICTED, lw=1.6, label="mean")
    # Residuals of a sticking joint are ten times the others and are cut off.
    height = 6 * residual[scored].std()
    if height > 0.0:
        axis.set_ylim(-height, height)


def _error(run: _RunData, joint: Joint) -> str:
    if not run.scored:
        return "no sample away from reversals to score"
    residual, torque = (run.rms(joint.column(name)) for name in ("residual", "torque"))
    return f"RMSE {residual:.2f} of {torque:.1f} {joint.unit('torque')} rms"
