"""A run as a linear regression: torque and regressor behind the same filter, and which rows to
trust."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion, Piece
from pipelines.mechanics.run import Run
from pipelines.mechanics.slow_motion import edge, filtered, unsure
from pipelines.model import Model
from pipelines.signals.blocks import BlockAverage, dilate

REVERSAL_SPEED = 0.04
"""rad/s below which the sign of an exoskeleton's speed, and so friction, is not known; others go
slower or faster."""
TURN_S = 0.075
"""Beside a turn, where measured forces and the filtered acceleration are not of the same moment."""
REVERSAL_PADDING_S = 0.08
"""What a joint that stuck still does after it has come free."""


@dataclass(frozen=True)
class Regression:
    """m blocks of a run, J joints, p parameters: ``torque = regressor @ parameters + noise``."""

    time: NDArray
    """(m,) s, the middle of each block."""
    segment: NDArray
    regressor: NDArray
    """(m, J, p)."""
    torque: NDArray
    """(m, J) N·m."""
    valid: NDArray
    """(m,) bool: every sample of the block is trusted."""
    usable: NDArray
    """(m, J) bool: valid, and away from that joint's reversals."""
    state: tuple[NDArray, NDArray, NDArray]
    """q, dq, ddq, (m, J) each."""

    @property
    def scored(self) -> NDArray:
        """(m,) bool: usable at every joint, as the RMSE counts it."""
        return np.asarray(self.usable.all(axis=1))


def residual_of(r: Regression, values: NDArray) -> NDArray:
    """Return measured less predicted torque, (m, J) N·m."""
    return r.torque - r.regressor @ values


def by_segment(segment: NDArray, scores: NDArray) -> Iterator[tuple[int, NDArray]]:
    """Yield each segment's number and its part of the blocks' ``scores`` (m, k), whose segments
    (m,) follow in turn."""
    begins = np.flatnonzero(np.diff(segment)) + 1
    for rows in np.split(np.arange(len(scores)), begins):
        if len(rows):
            yield int(segment[rows[0]]), scores[rows]


def block_average(motion: Run) -> BlockAverage:
    """Return the regression filter that the motion's file asks for; a filter of another kind is
    refused."""
    chosen = motion.metadata.get("regression_filter") or {}
    kind = chosen.get("kind", "block_average")
    if kind != "block_average":
        raise InputError(
            f'{motion.file or "the motion"}: metadata regression_filter.kind: found "{kind}",'
            ' expected "block_average"; filter the recording with `exoid filter`, or leave'
            " regression_filter out for blocks of 25 ms"
        )
    if "decimation" in chosen:
        return BlockAverage(int(chosen["decimation"]))
    return BlockAverage.lasting(0.025, motion.sample_rate_hz)


def reversal_speeds(machine: Machine) -> NDArray:
    """Return the speed of each joint below which its sign is not known, (J,) rad/s, m/s at a
    prismatic joint."""
    return np.array([REVERSAL_SPEED * machine.scale(joint).speed for joint in machine.names])


def mask_in_words(machine: Machine) -> str:
    """Say which samples are left out for being near a reversal."""
    speeds = reversal_speeds(machine)
    units = [joint.unit("velocity") for joint in machine.joints]
    parts = [f"{v:.2g} {unit}" for v, unit in zip(speeds, units, strict=True)]
    alike = (
        parts[:1]
        if len(set(parts)) == 1
        else [f"{s} ({name})" for s, name in zip(parts, machine.names, strict=True)]
    )
    return f"|v| < {', '.join(alike)}, padded {REVERSAL_PADDING_S:g} s"


def away_from_reversals(motion: Motion) -> NDArray:
    """Tell for each sample and joint whether it moves, and has moved for a while: (n, J) bool."""
    slow = np.abs(motion.dq) < reversal_speeds(motion.machine)
    return ~np.column_stack([dilate(column, padding(motion)) for column in slow.T])


def padding(run: Run) -> int:
    """Return how many samples beside a reversal are left out."""
    return round(REVERSAL_PADDING_S * run.sample_rate_hz)


def away_from_turns(motion: Motion) -> NDArray:
    """Tell for each sample whether no joint turns round within ``TURN_S``, (n,) bool.

    Where a joint stops, friction jumps and so does the acceleration of every link; filtered,
    neither is at its time.
    """
    return np.asarray(~dilate(np.any(turns(motion), axis=1), round(TURN_S * motion.sample_rate_hz)))


def turns(motion: Motion) -> NDArray:
    """Tell for each sample and joint whether it has turned round since the sample before: (n, J)
    bool."""
    turned = np.zeros(motion.dq.shape, dtype=bool)
    turned[1:] = np.diff(motion.dq > 0, axis=0)
    return turned


def regressions(run: Run, model: Model, cutoff_hz: float | None = None) -> Iterator[Regression]:
    """Yield a run as one linear regression, piece by piece; where there is a cut-off, only what is
    slower."""
    reach = edge(run.sample_rate_hz, cutoff_hz) if cutoff_hz else 0
    for piece in run.pieces(block_average(run).decimation + padding(run) + reach):
        yield regress(piece, model, cutoff_hz)


def regress(piece: Piece, model: Model, cutoff_hz: float | None = None) -> Regression:
    """Compute the regressor at full rate, then average it and the torque over the same blocks.

    Both go through the same low-pass before, where there is a cut-off. A block belongs to the piece
    in whose core it begins; what it needs beyond stands in the margin.
    """
    motion, core = piece.motion, piece.core
    block = block_average(motion)
    starts = block.starts(motion.segment, piece.before)
    starts = starts[(starts >= core.start) & (starts < core.stop)]
    regressor, torque, trusted = model.regressor(motion), motion.torque, motion.valid
    if cutoff_hz:
        regressor, torque = (
            filtered(motion, np.nan_to_num(x), cutoff_hz) for x in (regressor, torque)
        )
        trusted = trusted & ~unsure(motion, cutoff_hz)
    valid = block.all(trusted, starts)
    return Regression(
        time=block.mean(motion.time, starts),
        segment=motion.segment[starts],
        regressor=block.mean(regressor, starts),
        torque=block.mean(torque, starts),
        valid=valid,
        usable=valid[:, np.newaxis] & block.all(away_from_reversals(motion), starts),
        state=(
            block.mean(motion.q, starts),
            block.mean(motion.dq, starts),
            block.mean(motion.ddq, starts),
        ),
    )
