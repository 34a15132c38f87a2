"""A run as a linear regression: torque and regressor through one filter, with the rows to use."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion, Piece
from pipelines.mechanics.run import Run
from pipelines.mechanics.slow_motion import filtered, unsure
from pipelines.mechanics.stretches import edge
from pipelines.model import Model
from pipelines.signals.blocks import BlockAverage, dilate

REVERSAL_PADDING_S = 0.08
"""Time for which a joint is disturbed after it has stuck."""


@dataclass(frozen=True)
class Regression:
    """m blocks of a run, J joints, p parameters: ``torque = regressor @ parameters + noise``."""

    time: NDArray
    """(m,) s, middle of each block."""
    segment: NDArray
    """(m,) number of the unbroken stretch of each block."""
    regressor: NDArray
    """(m, J, p) N·m per unit."""
    torque: NDArray
    """(m, J) N·m."""
    valid: NDArray
    """(m,) bool: whether every sample of the block is valid."""
    usable: NDArray
    """(m, J) bool: whether the block is valid and away from that joint's reversals; false at a
    joint whose torque was not measured."""
    state: tuple[NDArray, NDArray, NDArray]
    """q, dq, ddq, (m, J) each; rad, rad/s, rad/s²."""
    measured: NDArray
    """(J,) bool: joints whose torque is known."""

    @property
    def scored(self) -> NDArray:
        """(m,) bool: whether the block is usable at every measured joint, as the RMSE counts it."""
        return np.asarray(self.usable[:, self.measured].all(axis=1))


def residual_of(r: Regression, values: NDArray) -> NDArray:
    """Return measured less predicted torque.

    Parameters
    ----------
    r : Regression
        m block means of J joints, regressor (m, J, p).
    values : (p,) array
        Parameters.

    Returns
    -------
    (m, J) array
        Residual, N·m.
    """
    return r.torque - r.regressor @ values


def by_segment(segment: NDArray, scores: NDArray) -> Iterator[tuple[int, NDArray]]:
    """Yield each segment's number and its scores.

    Parameters
    ----------
    segment : (m,) array
        Segment of each block, in order.
    scores : (m, k) array
        Scores of each block.
    """
    begins = np.flatnonzero(np.diff(segment)) + 1
    for rows in np.split(np.arange(len(scores)), begins):
        if len(rows):
            yield int(segment[rows[0]]), scores[rows]


def block_average(motion: Run) -> BlockAverage:
    """Return the regression filter of a motion's file.

    Raises
    ------
    InputError
        If the file asks for a filter of another kind.
    """
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
    # Blocks of 25 ms lose half the power at 17.7 Hz, well above a leg's motion.
    return BlockAverage.lasting(0.025, motion.sample_rate_hz)


def reversal_speeds(machine: Machine) -> NDArray:
    """Return the speed of each joint below which its sign is uncertain.

    Returns
    -------
    (J,) array
        rad/s; m/s at a prismatic joint.
    """
    # Speed in rad/s below which the sign of an exoskeleton's velocity, and so its friction, is
    # uncertain; scaled for other machines.
    speed = 0.04
    return np.array([speed * machine.scale(joint).speed for joint in machine.names])


def mask_in_words(machine: Machine) -> str:
    """Describe the samples that are left out for being near a reversal."""
    # No equation of the other joints is used.
    speeds, names = reversal_speeds(machine)[machine.measured], machine.measured_names
    units = [machine.joint(name).unit("velocity") for name in names]
    parts = [f"{v:.2g} {unit}" for v, unit in zip(speeds, units, strict=True)]
    alike = (
        parts[:1]
        if len(set(parts)) == 1
        else [f"{s} ({name})" for s, name in zip(parts, names, strict=True)]
    )
    return f"|v| < {', '.join(alike)}, padded {REVERSAL_PADDING_S:g} s"


def away_from_reversals(motion: Motion) -> NDArray:
    """Return whether each joint moves at each sample, and has moved for a while.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (n, J) bool array
        False within ``REVERSAL_PADDING_S`` of a speed below the joint's ``reversal_speeds``.
    """
    slow = np.abs(motion.dq) < reversal_speeds(motion.machine)
    # A joint that stuck starts with a transient that no column describes, hence the padding.
    return ~np.column_stack([dilate(column, padding(motion)) for column in slow.T])


def padding(run: Run) -> int:
    """Return the number of samples on each side of a reversal that are left out."""
    return round(REVERSAL_PADDING_S * run.sample_rate_hz)


def away_from_turns(motion: Motion) -> NDArray:
    """Return whether no joint turns within ``TURN_S`` of each sample.

    Where a joint turns, its friction jumps, and so does the acceleration of every link. After
    filtering, neither is at its time.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (n,) bool array
        False near a turn of any joint.
    """
    # Within 75 ms of a turn measured forces and filtered acceleration are not simultaneous.
    reach = round(0.075 * motion.sample_rate_hz)
    return np.asarray(~dilate(np.any(turns(with_rest(motion)), axis=1), reach))


def with_rest(motion: Motion) -> Motion:
    """Return the motion without the velocity of joints that rest throughout (``at_rest``).

    Noise of the encoder of a joint that is held would be an acceleration, which no torque has.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.
    """
    # Most machines have every torque, and nothing to look for.
    if motion.machine.measured.all():
        return motion
    rests = at_rest(motion)
    dq, ddq = (np.where(rests, 0.0, x) for x in (motion.dq, motion.ddq))
    return motion.with_state(motion.q, dq, ddq)


def at_rest(motion: Motion) -> NDArray:
    """Return which joints rest throughout, of those whose torque was not measured.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (J,) bool array
        False at a measured joint, which must move.
    """
    return ~moves(motion) & ~motion.machine.measured


def moves(motion: Motion) -> NDArray:
    """Return whether each joint moves away from reversals at some valid sample.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (J,) bool array
    """
    return np.any(away_from_reversals(motion) & motion.valid[:, np.newaxis], axis=0)


def turns(motion: Motion) -> NDArray:
    """Return whether each joint has turned since the sample before.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (n, J) bool array
        False at the first sample.
    """
    turned = np.zeros(motion.dq.shape, dtype=bool)
    # A difference of bools is true where neighbours differ.
    turned[1:] = np.diff(motion.dq > 0, axis=0)
    return turned


def regressions(run: Run, model: Model, cutoff_hz: float | None = None) -> Iterator[Regression]:
    """Yield a run as one linear regression, piece by piece.

    Parameters
    ----------
    run : Run
        A motion in memory or on disk.
    model : Model
        Its linear parameters are the p columns.
    cutoff_hz : float, optional
        Cut-off of a low-pass of regressor and torque, Hz; none by default.

    Yields
    ------
    Regression
        Block means of one piece.
    """
    reach = edge(run.sample_rate_hz, cutoff_hz) if cutoff_hz else 0
    # A block may end beyond the core, and the mask and the low-pass look beyond it as well.
    for piece in run.pieces(block_average(run).decimation + padding(run) + reach):
        yield regress(piece, model, cutoff_hz)


def regress(piece: Piece, model: Model, cutoff_hz: float | None = None) -> Regression:
    """Compute the regressor at full rate, then average it and the torque over the same blocks.

    A block belongs to the piece in whose core it begins; its remaining samples are in the margin.

    Parameters
    ----------
    piece : Piece
        n samples of J joints with their margins.
    model : Model
        Its linear parameters are the p columns.
    cutoff_hz : float, optional
        Cut-off of a low-pass that regressor and torque pass before, Hz.

    Returns
    -------
    Regression
        m block means: regressor (m, J, p), N·m per unit; torque (m, J), N·m.
    """
    motion, core = with_rest(piece.motion), piece.core
    block = block_average(motion)
    starts = block.starts(motion.segment, piece.before)
    starts = starts[(starts >= core.start) & (starts < core.stop)]
    regressor, torque, trusted = model.regressor(motion), motion.torque, motion.valid
    if cutoff_hz:
        # A single NaN would spread over its whole stretch in the recursive filter.
        regressor, torque = (
            filtered(motion, np.nan_to_num(x), cutoff_hz) for x in (regressor, torque)
        )
        trusted = trusted & ~unsure(motion, cutoff_hz)
    valid, measured = block.all(trusted, starts), motion.machine.measured
    return Regression(
        time=block.mean(motion.time, starts),
        segment=motion.segment[starts],
        regressor=block.mean(regressor, starts),
        torque=block.mean(torque, starts),
        valid=valid,
        usable=valid[:, np.newaxis] & measured & block.all(away_from_reversals(motion), starts),
        state=(
            block.mean(motion.q, starts),
            block.mean(motion.dq, starts),
            block.mean(motion.ddq, starts),
        ),
        measured=measured,
    )
