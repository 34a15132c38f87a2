"""The figures of an identification: predicted torque and residuals of each validation run."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Rows
from pipelines.plotting.chart import Chart, DrawnTable, Role, named
from pipelines.plotting.matplotlib_charts import chart_figure, grid_figure
from pipelines.plotting.residual_panels import residual_panel, residual_reach, torque_panels
from pipelines.plotting.style import STYLE, save


@dataclass
class _RunData:
    """The drawn rows of one run, and sums over all its rows."""

    frame: pd.DataFrame
    every: int = 1
    passed: int = 0
    scored: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    """Sum of squares of each column over the scored rows."""
    most: int = 20_000
    """Most rows that are drawn; of a longer run every second, fourth, ... row is drawn."""

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
        while len(self.frame) > self.most:
            self.frame = self.frame.iloc[::2].reset_index(drop=True)
            self.every *= 2

    def rms(self, column: str) -> float:
        return float(np.sqrt(self.squares[column] / self.scored)) if self.scored else np.nan


def draw(residuals: Rows, folder: Path) -> list[str]:
    """Write the figures of every validation run as PNG and PDF.

    Parameters
    ----------
    residuals : Rows
        A ``residuals/1`` table, N·m.
    folder : Path
        Where to write them.

    Returns
    -------
    list of str
        Names of the PNG files.
    """
    names = list[str]()
    joints = [joint for joint in residuals.joints if joint.is_measured]
    with plt.rc_context(STYLE):
        for file, run in _validation_runs(residuals).items():
            name = Path(file).stem
            save(chart_figure(_torque(run, joints, name)), folder / f"torque-{name}")
            grid = [_residuals(run, joint) for joint in joints]
            title = f"residual of {name} against time, angle and velocity"
            save(grid_figure(title, grid), folder / f"residual-{name}")
            names += [f"torque-{name}.png", f"residual-{name}.png"]
    return sorted(names)


def _validation_runs(residuals: Rows) -> dict[str, _RunData]:
    quantities = ("residual", "torque")
    columns = [joint.column(name) for joint in residuals.joints for name in quantities]
    runs: dict[str, _RunData] = {}
    for piece in residuals.pieces():
        frame = piece.to_pandas()
        for name, rows in frame[frame["purpose"] == "validate"].groupby("file", sort=False):
            runs.setdefault(str(name), _RunData(rows.iloc[:0])).add(rows, columns)
    return runs


def _torque(run: _RunData, joints: Sequence[Joint], name: str) -> Chart:
    """Return measured and predicted torque over time, and the residual, of every joint."""
    model = DrawnTable("predicted", Role.AFTER, run.frame)
    panels = [
        named(joint, panel)
        for joint in joints
        for panel in torque_panels(joint, run.frame, [model])
    ]
    title = f"torque of {name}: {'; '.join(_error(run, joint) for joint in joints)}"
    return Chart("torque", title, "", "time, s", run.frame["time_s"].to_numpy(), tuple(panels))


def _residuals(run: _RunData, joint: Joint) -> list[Chart]:
    """Return a joint's residual against time, angle and speed; noise has no shape in any."""
    scored = run.frame[run.frame["scored"]]
    model, reach = DrawnTable("running mean", Role.AFTER, scored), residual_reach(scored, joint)
    against = {"time, s": "time_s"} | {
        f"{joint.name} {words}, {joint.unit(quantity)}": joint.column(quantity)
        for quantity, words in (("angle", joint.place), ("velocity", "velocity"))
    }
    charts = []
    for label, column in against.items():
        x, panel = residual_panel(joint, column, [model], reach)
        charts.append(Chart("residual", "", "", label, x, (panel,)))
    return charts


def _error(run: _RunData, joint: Joint) -> str:
    if not run.scored:
        return f"{joint.name} is not scored, as not all joints move at once"
    residual, torque = (run.rms(joint.column(name)) for name in ("residual", "torque"))
    return f"{joint.name} RMSE {residual:.2f} of {torque:.1f} {joint.unit('torque')} rms"
