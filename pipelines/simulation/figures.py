"""The paper's Figures 3 to 6, and a recording with its simulation."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt

from pipelines.contracts import Joint
from pipelines.plotting.chart import Chart, DrawnTable, Panel, Role, Series, named
from pipelines.plotting.matplotlib_charts import chart_figure
from pipelines.plotting.simulation_panels import (
    GAIN,
    drives_loop_panels,
    loop_panels,
    settled_error,
    sweep_panel,
    window_panels,
)
from pipelines.plotting.style import STYLE, save


def draw_tracking(
    frame: pd.DataFrame,
    joints: Sequence[Joint],
    folder: Path,
    limit_nm: float,
    settled_after_s: float,
) -> None:
    """Draw tracking, error and torque of a closed loop (Figures 4 to 6).

    Parameters
    ----------
    frame : DataFrame
        A ``simulation/1`` table.
    joints : sequence of Joint
        Joints of the table.
    folder : Path
        Where to write ``tracking``, ``error`` and ``torque``.
    limit_nm : float
        Torque limit to draw, N·m.
    settled_after_s : float
        Start of the settled part, s.
    """
    loop = [DrawnTable("simulated", Role.AFTER, frame)]
    panels = [loop_panels(joint, loop, settled_after_s) for joint in joints]
    settled = " and ".join(
        f"{joint.name} within ± {settled_error(frame, joint, settled_after_s):.1f}"
        f" m{joint.unit('angle')}"
        for joint in joints
    )
    titles = {
        "tracking": f"{' and '.join(joint.name for joint in joints)} under adaptive RBF control",
        "error": f"tracking error: {settled} after {settled_after_s:g} s",
        "torque": "torque of the drives, and the network's share of it",
    }
    for number, (name, title) in enumerate(titles.items()):
        rows = [own[number] for own in panels]
        if name == "torque":
            rows = [_with_share(*one, frame, limit_nm) for one in zip(joints, rows, strict=True)]
        _draw(title, frame, joints, [[panel] for panel in rows], folder / name)


def _with_share(joint: Joint, torque: Panel, frame: pd.DataFrame, limit_nm: float) -> Panel:
    """Return a panel of torque with the network's share, and the limit if it is not far."""
    network = frame[joint.column("network")].to_numpy()
    series = [*torque.series, Series("network's share", network, Role.BEFORE)]
    # A distant limit would flatten the curves.
    if frame[joint.column("torque")].abs().max() > 0.7 * limit_nm:
        bounds = (np.full(len(frame), sign * limit_nm) for sign in (-1.0, 1.0))
        series += [Series("limit", bound, Role.WANTED) for bound in bounds]
    return replace(torque, series=tuple(series))


def draw_sweep(sweep: pd.DataFrame, joints: Sequence[Joint], folder: Path, chosen: float) -> None:
    """Draw the largest settled error against the feedback gain (Figure 3).

    Parameters
    ----------
    sweep : DataFrame
        Gains, N·m·s/rad, and the error of each joint, rad.
    joints : sequence of Joint
        Joints of the table.
    folder : Path
        Where to write ``kv-sweep``.
    chosen : float
        Gain of the simulation, N·m·s/rad.
    """
    panels = tuple(sweep_panel(joint, [DrawnTable("", Role.AFTER, sweep)]) for joint in joints)
    title = f"largest settled error against the feedback gain, of which {chosen:g} is chosen"
    gains, label = sweep[GAIN].to_numpy(float), "feedback gain Kv, N·m·s/rad"
    with plt.rc_context(STYLE):
        save(chart_figure(Chart("kv-sweep", title, "", label, gains, panels)), folder / "kv-sweep")


def draw_replay(
    open_loop: pd.DataFrame,
    closed_loop: pd.DataFrame | None,
    joints: Sequence[Joint],
    stem: Path,
    name: str,
) -> None:
    """Draw a recording with its simulation.

    Parameters
    ----------
    open_loop : DataFrame
        Windows under the recorded torque, a ``simulation/1`` table.
    closed_loop : DataFrame or None
        The drives' loop under the recorded references, if it was simulated.
    joints : sequence of Joint
        Joints of the tables.
    stem : Path
        Path of the figure without suffix; that of the drives' loop ends with ``-closed-loop``.
    name : str
        Name of the recording.
    """
    windows = [DrawnTable("simulated", Role.AFTER, open_loop)]
    panels = [window_panels(joint, windows) for joint in joints]
    title = f"simulation of {name} under the recorded torque, in windows of 1 s"
    _draw(title, open_loop, joints, panels, stem)
    if closed_loop is not None:
        panels = [drives_loop_panels(joint, closed_loop) for joint in joints]
        title = f"simulation of {name} in the drives' loop, under the recorded references"
        _draw(title, closed_loop, joints, panels, stem.with_name(f"{stem.name}-closed-loop"))


def _draw(
    title: str,
    frame: pd.DataFrame,
    joints: Sequence[Joint],
    panels: Sequence[Sequence[Panel]],
    stem: Path,
) -> None:
    """Write the figure of panels over time, those of each joint below those of the one before."""
    rows = tuple(
        named(joint, panel) for joint, own in zip(joints, panels, strict=True) for panel in own
    )
    chart = Chart(stem.name, title, "", "time, s", frame["time_s"].to_numpy(), rows)
    with plt.rc_context(STYLE):
        save(chart_figure(chart), stem)
