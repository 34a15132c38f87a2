"""All runs as one linear regression: outputs, baseline columns, masks and folds.

An *output* is one measured torque: each drive's and, where there are cuff forces, the torque about each
joint that they exert on the person. The second pair is a second measurement of the human's share, and
what separates causes in the drive or the structure from causes in the person.

Baseline parameters, in the order of the columns: the rigid body (a leg's X1..X4) of the machine, that of the person,
Coulomb and viscous friction of each joint, what else the machine is known to have, the force sensors' zeros. With one
kind of run and no cuff forces one rigid body takes the place of the two.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.effects import Effect, Side
from pipelines.effects.friction import Friction
from pipelines.estimation.regression import away_from_reversals, away_from_turns, block_average
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.slow_motion import filtered, unsure
from pipelines.signals.blocks import BlockAverage

FOLD_S = 10.0
"""Length of a fold where the excitation does not repeat."""
FOLDS = 4
ZEROS = 3
"""Force zeros that show in the cuffs' torque: shank along, shank across, thigh across."""


@dataclass(frozen=True)
class Run:
    """One motion behind the regression filter, m blocks, O outputs (drives, then cuffs)."""

    motion: Motion
    block: BlockAverage
    starts: NDArray
    time: NDArray
    """(m,) s."""
    state: tuple[NDArray, NDArray, NDArray]
    """q, dq, ddq (m, J)."""
    measured: NDArray
    """(m, O) N·m; NaN where there is no such output."""
    usable: NDArray
    """(m, O) bool."""
    valid: NDArray
    """(m,) bool."""
    fold: NDArray
    """(m,) number of the fold: whole periods, dealt out in turn."""
    period: NDArray
    """(m,) number of the excitation's period, -1 where it does not repeat."""
    cutoff_hz: float | None = None
    """Above which neither torque nor columns are looked at; None where all that blocks pass is."""
    fast: NDArray | None = None
    """(m, O) N·m of the torque that blocks pass and the cut-off does not."""

    def average(self, full_rate: NDArray) -> NDArray:
        """Put (n, ...) at full rate behind the regression filter: (m, ...)."""
        return self.block.mean(self.slow(full_rate), self.starts)

    def slow(self, full_rate: NDArray) -> NDArray:
        """Return what (n, ...) at full rate holds below the cut-off, where there is one."""
        return full_rate if self.cutoff_hz is None else filtered(self.motion, full_rate, self.cutoff_hz)

    def with_fast(self, residual: NDArray) -> NDArray:
        """Return what is left (m, O) with what is faster than the cut-off: no column foretells it, and it may hum."""
        return residual if self.fast is None else residual + self.fast

    def blocks_in(self, seconds: float) -> float:
        """Return how many blocks last so long."""
        return seconds * self.motion.sample_rate_hz / self.block.decimation

    @property
    def bandwidth_hz(self) -> float:
        """Frequency at which the regression filter has lost half the power."""
        passed = self.block.cutoff_hz(self.motion.sample_rate_hz)
        return passed if self.cutoff_hz is None else min(passed, self.cutoff_hz)

    def measured_at(self, link: Motion) -> NDArray:
        """Return what was measured where the links move otherwise than the encoders say, (m, O) N·m."""
        if link.q is self.motion.q or not self.has_cuffs:
            return self.measured
        cuffs = self.motion.cuff_torque(link.q)
        assert cuffs is not None, "a run that has cuffs has their forces"
        joints = len(self.motion.joints)
        return np.hstack([self.measured[:, :joints], np.nan_to_num(self.average(cuffs))])

    @property
    def has_cuffs(self) -> bool:
        """Whether the person's share was measured."""
        return self.measured.shape[1] > len(self.motion.joints) and bool(self.usable[:, -1].any())


def observe(motion: Motion, cutoff_hz: float | None = None) -> Run:
    """Put one motion behind the regression filter, which may let nothing pass that is faster than a cut-off."""
    block = block_average(motion)
    starts = block.starts(motion.segment)
    time = block.mean(motion.time, starts)
    trusted = motion.valid if cutoff_hz is None else motion.valid & ~unsure(motion, cutoff_hz)
    valid = block.all(trusted, starts)
    usable = valid[:, np.newaxis] & block.all(away_from_reversals(motion), starts)
    outputs = [motion.torque]
    cuffs = motion.cuff_torque(motion.q) if motion.run == "with_human" else None
    if cuffs is None:
        outputs.append(np.full_like(motion.torque, np.nan))
        usable = np.hstack([usable, np.zeros_like(usable)])
    else:
        known = np.isfinite(block.mean(cuffs, starts))
        outputs.append(cuffs)
        steady = block.all(away_from_turns(motion), starts)
        usable = np.hstack([usable, (valid & steady)[:, np.newaxis] & known])
    whole = np.nan_to_num(np.hstack(outputs))
    slow = whole if cutoff_hz is None else filtered(motion, whole, cutoff_hz)
    length = motion.period_s or FOLD_S
    number = np.floor(time / length + 1e-9).astype(int)
    # A short run has no whole period for each fold: its stretches are dealt out instead.
    part = min(length, (time[-1] - time[0]) / FOLDS + 1e-6)
    return Run(
        motion=motion,
        block=block,
        starts=starts,
        time=time,
        state=(block.mean(motion.q, starts), block.mean(motion.dq, starts), block.mean(motion.ddq, starts)),
        measured=block.mean(slow, starts),
        usable=usable,
        valid=valid,
        fold=np.floor((time - time[0]) / part).astype(int) % FOLDS if part < length else number % FOLDS,
        period=number if motion.period_s else np.full(len(time), -1),
        cutoff_hz=cutoff_hz,
        fast=None if cutoff_hz is None else block.mean(whole - slow, starts),
    )


@dataclass(frozen=True)
class Baseline:
    """Names and sizes of the baseline's columns for the kinds of run at hand."""

    kinds: tuple[str, ...]
    machine: Machine
    cuffs: bool
    known: tuple[Effect, ...] = ()
    """What else the machine is known to have; each acts like friction, by linear parameters that all runs share."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the machine's joints."""
        return self.machine.names

    @property
    def body(self) -> int:
        """Number of a rigid body's parameters."""
        return len(self.machine.mechanism.parameters)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Whose rigid bodies are fitted: the exoskeleton's and the person's, or the one there is."""
        return ("exo_alone", "human") if len(self.kinds) == 2 or self.cuffs else self.kinds

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.body * len(self.bodies) + sum(len(e.linear) for e in self.beside_bodies) + ZEROS * self.cuffs

    @property
    def beside_bodies(self) -> tuple[Effect, ...]:
        """Friction of each joint, and what the machine is known to have; in the order of the columns."""
        return (*(Friction(joint, on=self.machine) for joint in self.joints), *self.known)

    @property
    def names(self) -> list[str]:
        """What messages call the columns, but for the cuffs' zeros, which are the last."""
        body = [p.name for p in self.machine.mechanism.parameters]
        person = [f"the person's {name}" for name in body] if len(self.bodies) == 2 else []
        return body + person + [f"{effect.joint} {p.name}" for effect in self.beside_bodies for p in effect.linear]

    def columns(self, motor: Motion, link: Motion, human: Motion | None = None) -> NDArray:
        """Baseline columns at full rate, (n, O, size).

        Parameters
        ----------
        motor : Motion
            As the motors move: what friction acts on.
        link : Motion
            As the exoskeleton's links move.
        human : Motion, optional
            As the person's limbs move, where not with the links.
        """
        (n, J), p = motor.q.shape, self.body
        out = np.zeros((n, 2 * J, self.size))
        g, mechanism = link.geometry, self.machine.mechanism
        out[:, :J, :p] = mechanism.regressor(link.q, link.dq, link.ddq, g)
        if len(self.bodies) == 2 and motor.run == "with_human":
            limb = human or link
            person = mechanism.regressor(limb.q, limb.dq, limb.ddq, g)
            out[:, :J, p : 2 * p] = person
            out[:, J:, p : 2 * p] = person
        at = p * len(self.bodies)
        for effect in self.beside_bodies:
            own = effect.columns(motor if effect.side is Side.DRIVE else link)
            out[:, :J, at : at + own.shape[2]] = own
            at += own.shape[2]
        if self.cuffs and motor.run == "with_human":
            L1, cos_knee, sin_knee = g.thigh_length_m, np.cos(link.q[:, 1]), np.sin(link.q[:, 1])
            d_thigh, d_shank = g.thigh_cuff_distance_m or 0.0, g.shank_cuff_distance_m or 0.0
            out[:, J, at] = L1 * sin_knee
            out[:, J, at + 1] = d_shank + L1 * cos_knee
            out[:, J + 1, at + 1] = d_shank
            out[:, J, at + 2] = d_thigh
        return out


def baseline_of(runs: Sequence[Run], known: Sequence[Effect] = ()) -> Baseline:
    """Return the baseline that the kinds of run at hand allow, with what else the machine is ``known`` to have."""
    kinds = tuple(k for k in ("exo_alone", "with_human") if any(run.motion.run == k for run in runs))
    return Baseline(kinds, runs[0].motion.machine, any(run.has_cuffs for run in runs), tuple(known))


def like_trained(run: Run, baseline: Baseline) -> Run:
    """Return the run without its cuffs where none was there to train on: their zeros are not known."""
    if baseline.cuffs or not run.has_cuffs:
        return run
    usable = run.usable.copy()
    usable[:, len(baseline.joints) :] = False
    return replace(run, usable=usable)


def residuals_at_full_rate(
    runs: Sequence[Run],
    baseline: Baseline,
    values: NDArray,
) -> list[NDArray]:
    """Return what the baseline with some values (b,) leaves of each run's torque, (n, J) N·m."""
    joints = len(baseline.joints)
    return [run.motion.torque - baseline.columns(run.motion, run.motion)[:, :joints] @ values for run in runs]


def with_load(run: Run, baseline: Baseline, values: NDArray) -> Run:
    """Return the run with the loads of links and limb estimated from the baseline's rigid bodies in ``values`` (b,)."""
    bodies = values[: baseline.body * len(baseline.bodies)].reshape(-1, baseline.body)
    # The first body is the machine's, which alone is there in runs without a wearer.
    body = bodies.sum(axis=0) if run.motion.run == "with_human" else bodies[0]
    return replace(run, motion=run.motion.loaded(body, bodies[-1]))
