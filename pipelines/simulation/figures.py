"""The paper's Figures 3 to 6, and a recording with its simulation."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.plotting.style import BLUE, GREY, ORANGE, STYLE, save

JOINT_COLOURS = (BLUE, ORANGE)


def draw_tracking(
    frame: pd.DataFrame,
    joints: tuple[Joint, ...],
    folder: Path,
    limit_nm: float,
    settled_after_s: float,
) -> None:
    """Draw tracking, error and torque of a closed loop (Figures 4 to 6).

    Parameters
    ----------
    frame : DataFrame
        A ``simulation/1`` table.
    joints : tuple of Joint
        Joints of the table.
    folder : Path
        Where to write ``tracking``, ``error`` and ``torque``.
    limit_nm : float
        Torque limit to draw, N·m.
    settled_after_s : float
        Begin of the settled part, s.
    """
    with plt.rc_context(STYLE):
        save(_tracking(frame, joints), folder / "tracking")
        save(_error(frame, joints, settled_after_s), folder / "error")
        save(_torque(frame, joints, limit_nm), folder / "torque")


def draw_sweep(sweep: pd.DataFrame, joints: tuple[Joint, ...], folder: Path, chosen: float) -> None:
    """Draw the largest settled error against the feedback gain (Figure 3).

    Parameters
    ----------
    sweep : DataFrame
        Gains, N·m·s/rad, and the error of each joint, rad.
    joints : tuple of Joint
        Joints of the table.
    folder : Path
        Where to write ``kv-sweep``.
    chosen : float
        Gain of the simulation, N·m·s/rad.
    """
    with plt.rc_context(STYLE):
        figure, axis = plt.subplots(figsize=(6, 3.6))
        gains = sweep["feedback_gain_nm_s_rad"]
        for joint, colour in zip(joints, JOINT_COLOURS, strict=False):
            errors = 1e3 * sweep[joint.column("error")]
            axis.plot(gains, errors, "o-", ms=3.5, color=colour, label=joint.name)
        axis.axvline(chosen, color=GREY, lw=0.9, ls=":")
        place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top"}
        offset: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points"}
        axis.annotate("chosen", (chosen, 0.97), color=GREY, **place, **offset)
        axis.set(xlabel="feedback gain Kv, N·m·s/rad", ylabel="largest settled error, mrad")
        axis.set_ylim(0, None)
        axis.legend()
        axis.set_title("More feedback, less error", loc="left", fontweight="bold")
        save(figure, folder / "kv-sweep")


def draw_replay(
    open_loop: pd.DataFrame,
    closed_loop: pd.DataFrame | None,
    joints: tuple[Joint, ...],
    stem: Path,
    title: str,
) -> None:
    """Draw a recording with its simulation.

    Parameters
    ----------
    open_loop : DataFrame
        Windows under the recorded torque, a ``simulation/1`` table.
    closed_loop : DataFrame or None
        The drives' loop under the recorded references, if it was simulated.
    joints : tuple of Joint
        Joints of the tables.
    stem : Path
        Path of the figure without suffix.
    title : str
        Title of the figure.
    """
    with plt.rc_context(STYLE):
        columns = 1 if closed_loop is None else 2
        size, heights = (6 * columns, 4 * len(joints)), [2, 1] * len(joints)
        shape: dict[str, Any] = {"figsize": size, "height_ratios": heights, "squeeze": False}
        figure, axes = plt.subplots(2 * len(joints), columns, sharex="col", **shape)
        for j, joint in enumerate(joints):
            _windows(axes[2 * j, 0], axes[2 * j + 1, 0], open_loop, joint)
            if closed_loop is not None:
                _torques(axes[2 * j, 1], axes[2 * j + 1, 1], closed_loop, joint)
        for axis in axes[-1]:
            axis.set_xlabel("time, s")
        axes[0, 0].set_title("under the recorded torque, 1 s windows", loc="left", fontsize=9)
        if closed_loop is not None:
            title_of_loop = "in the drives' loop under the recorded references"
            axes[0, 1].set_title(title_of_loop, loc="left", fontsize=9)
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="upper right", ncols=2)
        figure.suptitle(title, x=0.02, ha="left", fontweight="bold")
        figure.align_ylabels()
        figure.tight_layout()
        save(figure, stem)


def _panels(joints: tuple[Joint, ...]) -> tuple[Figure, NDArray]:
    size = (8, 2.3 * len(joints))
    figure, axes = plt.subplots(len(joints), 1, figsize=size, sharex=True, squeeze=False)
    return figure, axes[:, 0]


def _tracking(frame: pd.DataFrame, joints: tuple[Joint, ...]) -> Figure:
    figure, axes = _panels(joints)
    for axis, joint in zip(axes, joints, strict=True):
        wanted, angle = (frame[joint.column(name)] for name in ("reference", "angle"))
        axis.plot(frame["time_s"], wanted, color=GREY, lw=2.6, label="wanted")
        axis.plot(frame["time_s"], angle, color=ORANGE, lw=1.0, label="simulated")
        axis.set_ylabel(f"{joint.name} angle, {joint.unit('angle')}")
    return _finished(figure, axes, "The leg follows its reference")


def _error(frame: pd.DataFrame, joints: tuple[Joint, ...], settled_after_s: float) -> Figure:
    """Draw the error, scaled to its size once it has settled."""
    figure, axes = _panels(joints)
    for axis, joint in zip(axes, joints, strict=True):
        error = 1e3 * frame[joint.column("error")]
        worst = error[frame["time_s"] >= settled_after_s].abs().max()
        label = f"largest after {settled_after_s:g} s"
        axis.axhspan(-worst, worst, color=GREY, alpha=0.15, lw=0, label=label)
        axis.axhline(0, color="black", lw=0.6)
        axis.plot(frame["time_s"], error, color=BLUE, lw=1.0, label="error")
        # The first error, from rest to the reference, is far larger and may leave the axes.
        axis.set_ylim(-4 * worst, 4 * worst)
        unit = f"m{joint.unit('angle')}"
        axis.set_ylabel(f"{joint.name} error, {unit}")
        axis.set_title(f"settled within ± {worst:.1f} {unit}", loc="left", fontsize=9)
    return _finished(figure, axes, "What is left between reference and leg")


def _torque(frame: pd.DataFrame, joints: tuple[Joint, ...], limit_nm: float) -> Figure:
    figure, axes = _panels(joints)
    for axis, joint in zip(axes, joints, strict=True):
        torque = frame[joint.column("torque")]
        axis.plot(frame["time_s"], torque, color=ORANGE, lw=1.0, label="torque")
        network = frame[joint.column("network")]
        axis.plot(frame["time_s"], network, color=BLUE, lw=1.0, label="the network's share")
        # A distant limit would flatten the curves.
        if torque.abs().max() > 0.7 * limit_nm:
            for bound, label in ((-limit_nm, None), (limit_nm, "limit")):
                axis.axhline(bound, color=GREY, lw=0.9, ls=":", label=label)
        axis.set_ylabel(f"{joint.name} torque, {joint.unit('torque')}")
    return _finished(figure, axes, "What the drives deliver")


def _finished(figure: Figure, axes: Iterable[Axes], title: str) -> Figure:
    axes = list(axes)
    axes[-1].set_xlabel("time, s")
    axes[-1].margins(x=0.01)
    labels = {
        label: line
        for axis in axes
        for line, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    figure.legend(labels.values(), labels.keys(), loc="upper right", ncols=len(labels))
    figure.suptitle(title, x=0.02, ha="left", fontweight="bold")
    figure.align_ylabels()
    figure.tight_layout()
    return figure


def _windows(angles: Axes, errors: Axes, frame: pd.DataFrame, joint: Joint) -> None:
    # A break between two windows, so that no line joins the end of one to the begin of the next.
    ends = frame["window"].diff().fillna(0) != 0
    time = frame["time_s"].where(~ends)
    recorded = frame[joint.column("reference")]
    angles.plot(frame["time_s"], recorded, color=GREY, lw=2.4, label="recorded")
    angles.plot(time, frame[joint.column("angle")], color=ORANGE, lw=1.0, label="simulated")
    errors.axhline(0, color="black", lw=0.6)
    errors.plot(time, 1e3 * frame[joint.column("error")], color=BLUE, lw=0.9)
    angles.set_ylabel(f"{joint.name} angle, {joint.unit('angle')}")
    errors.set_ylabel(f"error, m{joint.unit('angle')}")


def _torques(torques: Axes, errors: Axes, frame: pd.DataFrame, joint: Joint) -> None:
    measured = frame[joint.column("torque_measured")]
    torques.plot(frame["time_s"], measured, color=GREY, lw=1.8)
    simulated = frame[joint.column("torque")]
    torques.plot(frame["time_s"], simulated, color=ORANGE, lw=0.9)
    errors.axhline(0, color="black", lw=0.6)
    errors.plot(frame["time_s"], measured - simulated, color=BLUE, lw=0.7)
    torques.set_ylabel(f"{joint.name} torque, {joint.unit('torque')}")
    errors.set_ylabel(f"error, {joint.unit('torque')}")
    spread = float(np.nanstd(measured - simulated))
    # Single spikes must not set the scale.
    errors.set_ylim(-6 * spread, 6 * spread)
