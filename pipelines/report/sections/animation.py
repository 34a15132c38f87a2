"""The machine in motion: measured, and in simulations of one second with each model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts import Table
from pipelines.report.sections.fit_quality import MODELS, replayed
from pipelines.report.session import Artifact, Session


@dataclass(frozen=True)
class Animation:
    """Frames of one run."""

    run: str
    kind: str
    """Name of the drawing: a value of ``DRAWN``."""
    lengths: tuple[float, ...]
    """Lengths of the drawn links, or half the travel of a slider, m."""
    time: NDArray
    """(n,) s."""
    angles: dict[str, NDArray]
    """``measured`` and each model's role: (n, joints), rad or m."""
    labels: dict[str, str]


def animations(session: Session) -> list[Animation]:
    """Return an animation of each replayed run, if the machine can be drawn."""
    if not drawn_as(session):
        return []
    return [_animation(session, run, replays) for run, replays in replayed(session).items()]


def drawn_as(session: Session) -> str:
    """Return the drawing's name for a session's machine; empty if there is none."""
    # Drawings by the kinds of a machine's joints.
    drawings = {
        ("revolute", "revolute"): "leg",
        ("revolute",): "pendulum",
        ("prismatic",): "slider",
    }
    return drawings.get(tuple(joint.kind for joint in session.joints), "")


def _animation(session: Session, run: str, replays: dict[str, Artifact]) -> Animation:
    tables = {model: session.table(one) for model, one in replays.items()}
    first = next(iter(tables.values()))
    time = first.frame["time_s"].to_numpy()
    rows = _frames(time, np.abs(first.stacked("error")).sum(axis=1))
    angles = {"measured": first.stacked("reference")[rows]}
    labels = {"measured": "measured"}
    for model, table in tables.items():
        if len(table.frame) == len(first.frame):
            role, words = MODELS[model]
            angles[role], labels[role] = table.stacked("angle")[rows], words
    kind, lengths = _machine(session, first, angles["measured"])
    return Animation(run, kind, lengths, time[rows], angles, labels)


def _frames(time: NDArray, error: NDArray) -> NDArray:
    """Return the rows to show, 50 a second, of the stretch with the largest error."""
    begin = time[0]
    # Of a longer run, only the stretch with the largest error of the first model is shown.
    longest_s = 40.0
    if time[-1] - begin > longest_s:
        # The sum over any stretch is a difference of two cumulative sums.
        total = np.concatenate([[0.0], np.cumsum(error**2)])
        ends = np.searchsorted(time, time + longest_s)
        # Only stretches inside the run; a shorter one at its end is part of the last.
        whole = time + longest_s <= time[-1]
        begin = time[np.argmax(np.where(whole, total[ends] - total[:-1], -1.0))]
    # The nearest later rows: positions are not interpolated, because windows end in jumps.
    wanted = np.arange(begin, min(begin + longest_s, time[-1]), 1.0 / 50.0)
    return np.unique(np.clip(np.searchsorted(time, wanted), 0, len(time) - 1))


def _machine(session: Session, table: Table, measured: NDArray) -> tuple[str, tuple[float, ...]]:
    drawn = drawn_as(session)
    if drawn == "slider":
        return drawn, (float(np.abs(measured).max()) or 1.0,)
    if drawn == "pendulum":
        return drawn, (1.0,)
    geometry = table.metadata.get("plant", {}).get("geometry", {})
    thigh = geometry.get("thigh_length_m") or 0.4
    # An assumed ratio: no file holds the shank's length, and no torque depends on it.
    return drawn, (thigh, 1.05 * thigh)
