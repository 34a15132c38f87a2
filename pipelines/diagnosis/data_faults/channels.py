"""Find channels that do not report the truth for a while: repeated, stuck, saturated, dead."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import (
    WHOLE_ROW,
    Fault,
    column,
    constant_stretches,
    mask_of,
    stretches,
    when,
)
from pipelines.diagnosis.data_faults.proof import Proof, compared, predictions
from pipelines.diagnosis.data_faults.rigid_fit import averages
from pipelines.mechanics.motion import CUFFS, Motion
from pipelines.mechanics.remedies import remedy_for_repeats
from pipelines.mechanics.stretches import edge
from pipelines.signals.blocks import dilate
from pipelines.signals.held import are_held

STALE = 3
"""Fewest rows that repeat the last one while the joint moves: fewer may be an accident."""
COUNTS = 2.0
"""Encoder counts that a joint moves before an equal reading is stale."""
NOISES = 4.0
"""Standard deviations of the angle's noise that the joint moves in addition."""
STUCK_ANGLE_S = 0.25
"""Least length of a stretch in which an angle is stuck, while its joint moves before and after,
s."""
JUMP = 3.0
"""Multiple of the largest step of the moving joint: no joint catches up that fast."""
HELD_S, HELD_RAD = 1.0, 0.1
"""Standstill, and travel of the set-point in that time, from which friction is no explanation. At a
prismatic joint the travel is scaled to the joint's."""
ALONE_S, ALONE = 2.0, 3.0
"""Least standstill without a set-point, and its least multiple of the longest other standstill."""
OUTLASTS = 3.0
"""Multiple of the next longest constant stretch from which a coarsely rounded torque is stuck."""
STUCK_TORQUE_S = 0.15
"""Least length of a stretch of constant torque that is stuck, s."""
STUCK_FORCE_S = 1.0
"""Least length of a stretch of constant cuff force that is stuck, s."""
FLAT_TOP, SATURATED = 3, 10
"""Samples in a row at the extreme, and samples in such rows: noise never returns to the same
number."""
IN_STEPS = 0.5
"""Share of samples that repeat the one before, from which a torque is rounded to coarse steps. A
finely rounded one is rarely the same twice."""


def channel_faults(motion: Motion) -> Iterator[Fault]:
    """Yield the faults of single channels of one run, and of channels that are copies."""
    yield from _repeated(motion)
    yield from _copied(motion)
    for joint in range(motion.torque.shape[1]):
        yield from _stuck_angle(motion, joint)
        # Without a sensor the torque is zero throughout, and no channel.
        if motion.machine.joints[joint].has_sensor:
            yield from _torque(motion, joint)
    if motion.held_forces is not None and motion.run == "with_human":
        yield from _forces(motion, motion.held_forces)


def _repeated(motion: Motion) -> Iterator[Fault]:
    """Report drives that give old values: angle and torque repeat while the joint moves.

    A torque that is rounded to coarse steps often repeats, and is no evidence of that.
    """
    if motion.measured_angle is None:
        return
    same: NDArray = np.zeros(motion.torque.shape, dtype=bool)
    # Both must repeat: at low speed, a coarse encoder or a rounded torque repeats alone.
    same[1:] = (np.diff(motion.measured_angle, axis=0) == 0) & (np.diff(motion.torque, axis=0) == 0)
    for j, torque in enumerate(motion.torque.T):
        # A torque that is constant for longer is stuck, whatever the angle does.
        stuck = constant_stretches(torque, round(STUCK_TORQUE_S * motion.sample_rate_hz))
        is_coarse = _repeats_itself(torque, stuck) and not are_held(torque)
        same[:, j] &= ~mask_of(stuck, len(torque)) & (not is_coarse)
    sure = same & _has_moved(motion, motion.measured_angle, same)
    stale = [j for j in range(len(motion.joints)) if sure[:, j].sum() >= STALE]
    if not stale:
        return
    # Drives that repeat in the same samples share a cause, such as one reader for all.
    together = len(stale) > 1 and bool(
        (same[:, stale].all(axis=1) == same[:, stale].any(axis=1)).mean() > 0.999
    )
    for j in stale[:1] if together else stale:
        samples = same[:, j]
        share, intervals = samples.mean(), stretches(samples)
        who = "every device" if together else f"{the(motion.joints[j])}'s drive"
        yield Fault(
            FaultKind.STALE,
            motion.file,
            WHOLE_ROW if together else column(motion, j, "angle"),
            f"{samples.sum()} repeated samples ({100 * share:.2g} %), {when(motion, intervals)}:"
            f" {who} gave the last sample's values again while the joint moved;"
            f" {remedy_for_repeats(motion)}",
            samples,
        )


def _has_moved(motion: Motion, angle: NDArray, same: NDArray) -> NDArray:
    """Return where a joint has surely moved since its last new angle, (n, J) bool.

    Parameters
    ----------
    motion : Motion
    angle : (n, J) array
        As measured, rad or m.
    same : (n, J) bool array
        Where the drive gave the last sample's values again.
    """
    travel = np.cumsum(motion.dq / motion.sample_rate_hz, axis=0)
    moved = np.zeros(angle.shape, dtype=bool)
    for j in range(angle.shape[1]):
        new = np.flatnonzero(~same[:, j])
        # Scatter of the new angles about the filtered speed.
        noise = median_abs_deviation(np.diff(angle[new, j] - travel[new, j]), scale="normal")
        last_new = new[np.searchsorted(new, np.arange(len(angle)), side="right") - 1]
        travel_since = np.abs(travel[:, j] - travel[last_new, j])
        moved[:, j] = travel_since > COUNTS * _count_of(angle[:, j]) + NOISES * noise
    return moved


def _copied(motion: Motion) -> Iterator[Fault]:
    """Report joints with identical torque: independent measurements differ at least by noise."""
    for i, j in combinations(range(len(motion.joints)), 2):
        if (
            np.array_equal(motion.torque[:, i], motion.torque[:, j])
            and np.ptp(motion.torque[:, i]) > 0.0
        ):
            one, other = (column(motion, k, "torque") for k in (i, j))
            yield Fault(
                FaultKind.COPY,
                motion.file,
                other,
                f"{one} and {other} are equal in every sample: probably one drive was read twice;"
                " check its address, register or column",
                proof=_of_one_alone(motion, (i, j)),
            )


def _of_one_alone(motion: Motion, joints: tuple[int, int]) -> Proof | None:
    """Return what it changes to leave the less plausible of two equal torques out."""
    run = averages(motion)
    if run is None:
        return None
    predicted = predictions(run)
    both = [predicted[j] for j in joints]
    return compared(both, [min(both, key=lambda one: one.unexplained)])


def _count_of(angle: NDArray) -> float:
    """Return the smallest step of an encoder, rad; infinite for one that never moved.

    Steps below 1e-9 are rounding: equal counts differ by 1e-16 in radians.
    """
    steps = np.abs(np.diff(angle))
    steps = steps[steps > 1e-9]
    return float(steps.min()) if len(steps) else np.inf


def _stuck_angle(motion: Motion, joint: int) -> Iterator[Fault]:
    """Report an angle that is constant while the leg moves on."""
    if motion.measured_angle is None:
        return
    angle = motion.measured_angle[:, joint]
    still = constant_stretches(angle, round(STUCK_ANGLE_S * motion.sample_rate_hz))
    lasting = still[:, 1] - still[:, 0]
    # Friction holds a joint too, but the joint then starts from where it stopped.
    stuck = still[
        # Other standstills show how long friction usually holds this joint.
        [_impossible(motion, joint, angle, s, np.delete(lasting, i)) for i, s in enumerate(still)]
    ]
    if len(stuck):
        samples = mask_of(stuck, len(angle))
        # The filter spreads the standstill into its neighbourhood.
        reach = edge(motion.sample_rate_hz, motion.cutoff_hz)
        yield Fault(
            FaultKind.STUCK,
            motion.file,
            column(motion, joint, "angle"),
            f"{the(motion.joints[joint])}'s angle is stuck: constant for"
            f" {samples.sum() / motion.sample_rate_hz:.2f} s, {when(motion, stuck)}, while the leg"
            " moved; check the encoder's cable and the drive's status",
            dilate(samples, reach),
        )


def _impossible(
    motion: Motion, joint: int, angle: NDArray, stretch: NDArray, others: NDArray
) -> bool:
    start, stop = stretch
    # Steps across a gap are larger, but not faster.
    steps = np.abs(np.diff(angle)) / np.maximum(np.diff(motion.time) * motion.sample_rate_hz, 1.0)
    # First test: the angle jumps into or out of the standstill, faster than the joint ever moves.
    outside = np.delete(steps, np.arange(max(start - 1, 0), min(stop, len(steps))))
    # Not the maximum, which a single glitch would set.
    usual = np.quantile(outside, 0.999) if len(outside) else 0.0
    edges = steps[[k for k in (start - 1, stop - 1) if 0 <= k < len(steps)]]
    if usual > 0 and (edges > JUMP * usual).any():
        return True
    # A joint whose torque was not measured may be held by a brake.
    if not motion.machine.joints[joint].is_measured:
        return False
    seconds = (stop - start) / motion.sample_rate_hz
    # Second test: the set-point went further than friction can hold a joint against its drive.
    if motion.reference is not None and np.isfinite(motion.reference[start:stop, joint]).all():
        return seconds > HELD_S and np.ptp(motion.reference[start:stop, joint]) > _held(
            motion, joint
        )
    # Third test, without a set-point: others moved, and no other standstill lasted nearly as long.
    rest = [j for j in range(motion.q.shape[1]) if j != joint]
    moved = max((np.ptp(motion.q[start:stop, j]) / _held(motion, j) for j in rest), default=0.0)
    longest = others.max(initial=0) / motion.sample_rate_hz
    # A joint may rest before the motion begins.
    return 0 < start and seconds > max(ALONE_S, ALONE * longest) and moved > 1.0


def _held(motion: Motion, joint: int) -> float:
    """Return the travel of a set-point, or another joint, that makes a standstill impossible."""
    return HELD_RAD * motion.machine.scale(motion.joints[joint]).travel


def _torque(motion: Motion, joint: int) -> Iterator[Fault]:
    """Report constant torque: at its extreme it is saturated, elsewhere stuck.

    A torque that is rounded to coarse steps, or held until new values come, also stays constant.
    Saturation cannot be detected there, and only an exceptionally long stretch counts as stuck.
    """
    torque = motion.torque[:, joint]
    flat = constant_stretches(torque, FLAT_TOP)
    at_top = (torque[flat[:, 0]] == torque.max()) | (torque[flat[:, 0]] == torque.min())
    lasts = flat[:, 1] - flat[:, 0] >= STUCK_TORQUE_S * motion.sample_rate_hz
    # Torque may be constant at rest. A tenth of the joint's range in a second counts as motion.
    moving = np.array(
        [np.abs(motion.dq[a:b, joint]).max() > 0.1 * np.ptp(motion.q[:, joint]) for a, b in flat],
        bool,
    )
    if _repeats_itself(torque, flat[at_top | lasts]):
        at_top = np.zeros_like(at_top)
        lasts &= _outlasts(flat)
    tops, stuck = flat[at_top], flat[~at_top & lasts & moving]
    # A saturated torque comes back to its limit, while a stuck one is flat once.
    if len(tops) > 1 and mask_of(tops, len(torque)).sum() >= SATURATED:
        yield _saturated(motion, joint, tops)
    elif len(tops) and (lasts & moving & at_top).any():
        stuck = flat[lasts & moving]
    if len(stuck):
        yield _stuck_torque(motion, joint, stuck)


def _saturated(motion: Motion, joint: int, tops: NDArray) -> Fault:
    torque, unit = motion.torque[:, joint], motion.machine.joints[joint].unit("torque")
    samples = mask_of(tops, len(torque))
    limits = " and ".join(f"{value:.4g} {unit}" for value in sorted({torque[a] for a, _ in tops}))
    return Fault(
        FaultKind.SATURATED,
        motion.file,
        column(motion, joint, "torque"),
        f"{the(motion.joints[joint])}'s torque is saturated: clipped at {limits} in {samples.sum()}"
        f" samples ({100 * samples.mean():.2g} %), {when(motion, tops)}; raise the sensor's range"
        " or the drive's limit, or move more gently",
        samples,
    )


def _stuck_torque(motion: Motion, joint: int, stuck: NDArray) -> Fault:
    samples = mask_of(stuck, len(motion.torque))
    return Fault(
        FaultKind.STUCK,
        motion.file,
        column(motion, joint, "torque"),
        f"{the(motion.joints[joint])}'s torque is stuck: constant for"
        f" {samples.sum() / motion.sample_rate_hz:.2f} s, {when(motion, stuck)}, while the joint"
        " moved; check the current sensor and the drive's status",
        samples,
    )


def _repeats_itself(torque: NDArray, apart: NDArray) -> bool:
    """Return whether a torque (n,) mostly repeats its last value outside stretches (runs, 2)."""
    rest = ~mask_of(apart, len(torque))[1:]
    return bool(rest.any()) and float(np.mean(torque[1:][rest] == torque[:-1][rest])) > IN_STEPS


def _outlasts(intervals: NDArray) -> NDArray:
    """Return whether a stretch (runs, 2) lasts ``OUTLASTS`` times any other, (runs,) bool."""
    lasting = intervals[:, 1] - intervals[:, 0]
    second = np.partition(lasting, -2)[-2] if len(lasting) > 1 else 0
    return np.asarray(lasting > OUTLASTS * second, dtype=bool)


def has_silent_cuffs(motion: Motion) -> bool:
    """Return whether the cuff forces of a person's run were recorded, and none ever changes."""
    if motion.held_forces is None or motion.run != "with_human":
        return False
    # Cuffs may be read less often than the drives, so samples between readings are unknown.
    channels = motion.held_forces.reshape(len(motion.held_forces), -1).T
    known = [x[np.isfinite(x)] for x in channels]
    return not any(len(x) and np.ptp(x) > 0.0 for x in known)


def _forces(motion: Motion, forces: NDArray) -> Iterator[Fault]:
    """Report cuff force channels that are dead, or constant for at least ``STUCK_FORCE_S``."""
    if has_silent_cuffs(motion):
        yield Fault(
            FaultKind.CUFFS,
            motion.file,
            f"{CUFFS[0]}_force_x_n",
            "all twelve cuff forces are constant all along with the person inside: no sensor"
            " answers. They are left out; check the sensors' supply and bus, or leave their"
            " columns out",
            without_cuffs=True,
        )
        return
    least = round(STUCK_FORCE_S * motion.sample_rate_hz)
    for c, cuff in enumerate(CUFFS):
        for i, axis in enumerate("xyz"):
            still = constant_stretches(forces[:, c, i], least)
            if not len(still):
                continue
            samples = mask_of(still, len(motion))
            # A channel that is dead all along has no good sample: the run's cuffs are left out.
            dead = samples.all()
            # All twelve were not dead above.
            extent = "all along while other sensors changed" if dead else when(motion, still)
            yield Fault(
                FaultKind.CUFFS,
                motion.file,
                f"{cuff}_force_{axis}_n",
                f"the {cuff.replace('_', ' ')} cuff's {axis} force is"
                f" {'dead' if dead else 'stuck'}: constant {extent};"
                " check the sensor's supply and cable, or leave its column out",
                None if dead else samples,
                without_cuffs=bool(dead),
            )
