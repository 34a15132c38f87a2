"""Panels of ``simulation/1`` tables: the adaptive loop, its sweep of Kv, and replays."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import Joint
from pipelines.plotting.chart import DrawnTable, Mark, Panel, Role, Series

GAIN = "feedback_gain_nm_s_rad"
"""Column of the gains in a sweep."""


def loop_panels(
    joint: Joint, loops: Sequence[DrawnTable], settled_after_s: float
) -> tuple[Panel, Panel, Panel]:
    """Return angle, error and torque of a joint in adaptive loops.

    Parameters
    ----------
    joint : Joint
    loops : sequence of DrawnTable
        ``simulation/1`` tables; one of another length than the first is left out.
    settled_after_s : float
        Start of the settled part, s, which determines the height of the errors.
    """
    first = loops[0].rows
    # A loop of another length cannot share the chart's time.
    loops = [loop for loop in loops if len(loop.rows) == len(first)]
    angles = _series(loops, joint.column("angle"))
    angles.append(Series("wanted", first[joint.column("reference")].to_numpy(), Role.WANTED))
    worst = max(settled_error(loop.rows, joint, settled_after_s) for loop in loops)
    unit = joint.unit("angle")
    return (
        Panel(f"{joint.place}, {unit}", tuple(angles)),
        # The start from rest exceeds the panel. A height of zero is no range, so it becomes None.
        Panel(
            f"error, m{unit}",
            tuple(_series(loops, joint.column("error"), 1e3)),
            reach=4.0 * worst or None,
        ),
        Panel(
            f"{joint.effort}, {joint.unit('torque')}", tuple(_series(loops, joint.column("torque")))
        ),
    )


def settled_error(loop: pd.DataFrame, joint: Joint, settled_after_s: float) -> float:
    """Return a joint's largest settled error in an adaptive loop, mrad; mm at a prismatic joint."""
    error = 1e3 * loop[joint.column("error")].to_numpy()
    return float(np.abs(error[loop["time_s"] >= settled_after_s]).max(initial=0.0))


def sweep_panel(joint: Joint, sweeps: Sequence[DrawnTable]) -> Panel:
    """Return a joint's largest settled error against the gain; all sweeps have the same gains."""
    curves = [
        Series(
            one.words, 1e3 * one.rows[joint.column("error")].to_numpy(float), one.role, Mark.MEAN
        )
        for one in sweeps
    ]
    return Panel(f"{joint.name}, m{joint.unit('angle')}", tuple(curves))


def window_panels(joint: Joint, replays: Sequence[DrawnTable]) -> tuple[Panel, Panel]:
    """Return a joint's angle in windows under the recorded torque, and its error.

    Parameters
    ----------
    joint : Joint
    replays : sequence of DrawnTable
        ``simulation/1`` tables of the same windows; one of another length is left out.
    """
    first = replays[0].rows
    angles, errors = [], []
    for replay in replays:
        if len(replay.rows) != len(first):
            continue
        angle, error = (_broken(replay.rows, joint.column(name)) for name in ("angle", "error"))
        angles.append(Series(replay.words, angle, replay.role))
        errors.append(Series(replay.words, 1e3 * error, replay.role))
    angles.append(Series("measured", first[joint.column("reference")].to_numpy(), Role.MEASURED))
    unit = joint.unit("angle")
    return (
        Panel(f"{joint.place}, {unit}", tuple(angles)),
        Panel(f"error, m{unit}", tuple(errors)),
    )


def drives_loop_panels(joint: Joint, loop: pd.DataFrame) -> tuple[Panel, Panel]:
    """Return a joint's torque in the drives' simulated loop, and its error."""
    measured = loop[joint.column("torque_measured")].to_numpy()
    simulated = loop[joint.column("torque")].to_numpy()
    error, unit = measured - simulated, joint.unit("torque")
    # Single spikes must not set the scale. A height of zero is no range, so it becomes None.
    reach = 6 * float(np.nanstd(error)) or None
    curves = (
        Series("simulated", simulated, Role.AFTER),
        Series("measured", measured, Role.MEASURED),
    )
    return (
        Panel(f"{joint.effort}, {unit}", curves),
        Panel(f"error, {unit}", (Series("simulated", error, Role.AFTER),), reach=reach),
    )


def _series(tables: Sequence[DrawnTable], column: str, factor: float = 1.0) -> list[Series]:
    return [
        Series(table.words, factor * table.rows[column].to_numpy(), table.role) for table in tables
    ]


def _broken(frame: pd.DataFrame, column: str) -> NDArray:
    """Return a column (n,) with NaN where a window begins, so that no line joins two windows."""
    begins = frame["window"].diff().fillna(0) != 0
    return frame[column].where(~begins, np.nan).to_numpy()
