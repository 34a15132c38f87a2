"""From a recording to a motion: zero-phase filtered angles, their derivatives, segments, and what to trust."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipelines.contracts.table import Table
from pipelines.errors import InputError, about
from pipelines.settings.filter import FilterSettings
from pipelines.signals.blocks import BlockAverage
from pipelines.signals.cutoff import Cutoff, choose_cutoff
from pipelines.signals.low_pass import derivative, low_pass, shortest

GAP = 1.5
"""Sample periods between two samples that make a gap, unless it is bridged."""
BRIDGED_S = 0.022
"""A shorter hole is interpolated: no leg does anything in it, and a bus that loses a sample here and there, or a
clock that stamps one late, would otherwise leave no stretch long enough to be filtered."""
JITTER = 0.02
"""Share of a sample period a sample may stray from the uniform grid before it is interpolated."""
EDGE_PERIODS = 1.5
"""Periods of the cut-off frequency at each end of a segment where the filter lacks one side."""


@dataclass(frozen=True)
class Kinematics:
    """Filtered motion of all joints, every array (n, J), and which samples to trust."""

    q: NDArray
    dq: NDArray
    ddq: NDArray
    segment: NDArray
    valid: NDArray
    cutoff: Cutoff


def motion_table(recording: Table, settings: FilterSettings) -> Table:
    """Make a ``motion/1`` table of a ``recording/1`` table.

    Angles are filtered and differentiated; torque, forces and the rest stay as measured; no sample is dropped.
    """
    frame, metadata = recording.frame, recording.metadata
    rate_hz = float(metadata["sample_rate_hz"])
    names = tuple(joint.name for joint in recording.joints)
    with about(recording.path):
        made = differentiate(frame["time_s"].to_numpy(float), recording.stacked("angle"), rate_hz, settings, names)
    columns: dict[str, Any] = {"time_s": frame["time_s"]}
    for j, joint in enumerate(recording.joints):
        columns[joint.column("angle")] = made.q[:, j]
        columns[joint.column("angle_measured")] = frame[joint.column("angle")]
        columns[joint.column("velocity")] = made.dq[:, j]
        columns[joint.column("acceleration")] = made.ddq[:, j]
        if joint.column("velocity") in frame:
            columns[joint.column("velocity_measured")] = frame[joint.column("velocity")]
    columns |= {name: frame[name] for name in frame.columns if name not in columns}
    columns |= {"segment": made.segment, "valid": made.valid}
    block = BlockAverage.lasting(settings.block_s, rate_hz)
    filters = {
        "filter": {
            "kind": "butterworth_zero_phase",
            "order": settings.order,
            "cutoff_hz": made.cutoff.hz,
            "why": made.cutoff.reason,
        },
        "regression_filter": block.as_metadata(rate_hz),
    }
    return Table(pd.DataFrame(columns), {**metadata, **filters}, recording.path)


def differentiate(
    time: NDArray, angle: NDArray, rate_hz: float, settings: FilterSettings, names: tuple[str, ...]
) -> Kinematics:
    """Filter measured angles and differentiate them, segment by segment.

    Parameters
    ----------
    time : (n,) array
        s, strictly increasing, with gaps.
    angle : (n, J) array
        rad or m.
    rate_hz : float
        Nominal sample rate.
    names : tuple of str
        The joints' names, for the reason given with the cut-off.
    """
    steps = np.diff(time)
    actual_hz = 1.0 / float(np.median(steps)) if len(steps) else rate_hz
    if not 0.5 < actual_hz / rate_hz < 2.0:
        raise InputError(
            f"metadata sample_rate_hz is {rate_hz:g}, but time_s advances by {1 / actual_hz:g} s "
            f"({actual_hz:g} Hz); correct the one that is wrong"
        )
    segment = np.concatenate([[0], np.cumsum(steps > max(GAP / rate_hz, BRIDGED_S))]).astype(np.int64)
    stretches = [np.flatnonzero(segment == s) for s in range(segment[-1] + 1)]
    longest = max(stretches, key=len)
    cutoff = _cutoff(time[longest], angle[longest], rate_hz, settings, names)
    q, dq, ddq = angle.copy(), np.zeros_like(angle), np.zeros_like(angle)
    valid = np.zeros(len(time), dtype=bool)
    edge = int(np.ceil(EDGE_PERIODS * rate_hz / cutoff.hz))
    for rows in stretches:
        if len(rows) < shortest(rate_hz, cutoff.hz):
            continue
        q[rows], dq[rows], ddq[rows] = _filtered(time[rows], angle[rows], rate_hz, cutoff.hz, settings.order)
        valid[rows[edge : len(rows) - edge]] = True
    if not valid.any():
        raise InputError(
            f"no stretch without a gap lasts the {2 * edge / rate_hz:.2f} s that a {cutoff.hz:.1f} Hz filter needs; "
            "the longest has "
            f"{_count(len(longest))}: record longer runs, or raise filter.cutoff_hz"
        )
    return Kinematics(q, dq, ddq, segment, valid, cutoff)


def _cutoff(time: NDArray, angle: NDArray, rate_hz: float, settings: FilterSettings, names: tuple[str, ...]) -> Cutoff:
    if settings.cutoff_hz == "auto":
        if len(time) < 2 * shortest(rate_hz, rate_hz / 8):
            raise InputError(
                f"the longest stretch without a gap has {_count(len(time))}, too few to choose a cut-off from; "
                "record longer runs, or set filter.cutoff_hz"
            )
        return choose_cutoff(_on_grid(time, angle, rate_hz)[1], rate_hz, names)
    if settings.cutoff_hz >= rate_hz / 2:
        raise InputError(
            f"filter.cutoff_hz is {settings.cutoff_hz:g}, expected less than half the sample rate of "
            f"{rate_hz:g} Hz; lower it"
        )
    return Cutoff(settings.cutoff_hz, "set by hand")


def _count(samples: int) -> str:
    return "1 sample" if samples == 1 else f"{samples} samples"


def _filtered(time: NDArray, angle: NDArray, rate_hz: float, cutoff_hz: float, order: int) -> list[NDArray]:
    """Return angle, velocity and acceleration of one stretch at its own times."""
    grid, uniform = _on_grid(time, angle, rate_hz)
    smooth = low_pass(uniform, rate_hz, cutoff_hz, order)
    states = [smooth, derivative(smooth, rate_hz, 1), derivative(smooth, rate_hz, 2)]
    return states if grid is time else [CubicSpline(grid, state)(time) for state in states]


def _on_grid(time: NDArray, angle: NDArray, rate_hz: float) -> tuple[NDArray, NDArray]:
    """Return uniform times and the angles there; the samples themselves where they are uniform already."""
    grid = time[0] + np.arange(len(time)) / rate_hz
    if np.max(np.abs(time - grid)) < JITTER / rate_hz:
        return time, angle
    grid = time[0] + np.arange(int((time[-1] - time[0]) * rate_hz) + 1) / rate_hz
    return grid, CubicSpline(time, angle)(grid)
