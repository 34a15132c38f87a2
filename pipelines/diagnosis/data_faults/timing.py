"""Find faults of time stamps: missing samples, jitter, wrong clock rates, counter jumps."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults.fault import Fault
from pipelines.diagnosis.data_faults.mends import mended
from pipelines.diagnosis.data_faults.proof import Ruling, by_motion
from pipelines.mechanics.motion import Motion
from pipelines.signals.sampling import HORIZON, local_period, missing_samples, sample_rate

SINGLE = 3
"""Most missing samples in a row that count as dropped; more are a gap."""
JITTER = 0.04
"""Rms deviation of irregular steps, in sample periods. Moving at 1 rad/s, 4 % of 5 ms is 0.2 mrad,
an encoder count."""
HALF, SURE = 0.5, 3.0
"""Share of the stamps' deviation that the angles follow, between none and all; standard errors."""
BLOCK = 20
"""Samples in a sum; such sums are nearly independent."""
RATE = 0.01
"""Relative error of a clock that is reported: velocity has the same error, acceleration twice
that."""


def timing_faults(motion: Motion) -> Iterator[Fault]:
    """Yield the faults of the time stamps of one run."""
    if len(motion) < 2:
        return
    late = motion.time * motion.sample_rate_hz - np.arange(len(motion))
    missing = _missing(motion)
    yield from _lost(motion, missing)
    yield from _counter(motion)
    # Without the samples that are missing, even stamps lie on a grid of the nominal rate.
    on_grid = late - np.concatenate([[0.0], np.cumsum(missing)])
    # A rate that changes is no jitter, so steps are compared with those around them.
    steps = np.diff(motion.time) / local_period(motion.time) - missing
    # The difference of two independent deviations has twice their variance.
    jitter = float(np.std(steps)) / np.sqrt(2.0)
    if jitter > JITTER:
        yield from _irregular(motion, on_grid, jitter)
    yield from _rate(motion, on_grid)


def _missing(motion: Motion) -> NDArray:
    """Return how many samples are missing before each but the first, (n - 1,) whole numbers.

    The counter shows them, or else the stamps.
    """
    if motion.sequence is None:
        return missing_samples(motion.time)
    step = _counted(motion.sequence)
    # A counter that jumps where time does not is a fault of its own: no sample is missing.
    return np.where(_disagrees(motion, step), 0, np.maximum(step - 1, 0))


def _counted(sequence: NDArray) -> NDArray:
    """Return by how many samples the counter advances, (n - 1,).

    Where each tenth row was kept, the counter advances by tens.
    """
    step = np.diff(sequence)
    usual = max(int(np.median(step)), 1) if len(step) else 1
    return np.asarray(np.rint(step / usual).astype(np.int64))


def _disagrees(motion: Motion, step: NDArray) -> NDArray:
    """Return where the counter's steps (n - 1,) and the clock's differ by several samples."""
    # A late stamp disagrees too, but by less.
    return np.abs(np.diff(motion.time) * motion.sample_rate_hz - step) > SINGLE


def _lost(motion: Motion, missing: NDArray) -> Iterator[Fault]:
    # The missing samples are absent already, and those around them are valid.
    nothing_to_mask = np.zeros(len(motion), dtype=bool)
    long, few = missing > SINGLE, (missing > 0) & (missing <= SINGLE)
    if long.any():
        # Beyond a usual step there, as the rate of the whole run may be another.
        lasts = np.diff(motion.time) - local_period(motion.time)
        k = int(np.argmax(np.where(long, lasts, -np.inf)))
        yield Fault(
            FaultKind.CLOCK,
            motion.file,
            "time_s",
            f"{_count(long.sum(), 'gap')} in the recording, the longest of {missing[k]} missing"
            f" samples ({lasts[k]:.2f} s) after {motion.time[k]:.2f} s:"
            " the fit leaves them out; record the run again if it repeats",
            nothing_to_mask,
        )
    if few.any():
        first, last = motion.time[:-1][few][[0, -1]]
        lost = int(missing[few].sum())
        yield Fault(
            FaultKind.CLOCK,
            motion.file,
            "time_s",
            f"{_count(lost, 'dropped sample')} ({100 * lost / (len(motion) + lost):.2g} %) "
            f"missing one by one between {first:.2f} s and {last:.2f} s: "
            "look for a bus that is too busy or a buffer that runs over",
            nothing_to_mask,
        )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("s" if number != 1 else "")


def _counter(motion: Motion) -> Iterator[Fault]:
    """Report a sample counter that goes back, stands still, or jumps where time does not."""
    if motion.sequence is None:
        return
    step = _counted(motion.sequence)
    # By the counter a restart is one sample later, and a row that repeats one is left out.
    by_counter = np.concatenate([[0.0], np.cumsum(np.where(step < 0, 1, step))])
    proof = by_motion(motion, mended(motion, motion.time[0] + by_counter / motion.sample_rate_hz))
    back, stands = step < 0, step == 0
    for bad, what, remedy in (
        (back, "goes back", "the device restarted: split the file there"),
        (stands, "stands still", "samples were duplicated: drop the repeated rows"),
        (
            (step > 0) & _disagrees(motion, step),
            "and time_s disagree by more than 3 samples",
            "find out which of the two clocks jumped",
        ),
    ):
        if bad.any():
            first = motion.time[1:][np.argmax(bad)]
            # No mask: nothing shows which rows are right.
            yield Fault(
                FaultKind.CLOCK,
                motion.file,
                "sequence",
                f"the sample counter {what} {_count(bad.sum(), 'time')}, first at {first:.2f} s:"
                f" {remedy}",
                proof=proof,
            )


def _irregular(motion: Motion, on_grid: NDArray, jitter: float) -> Iterator[Fault]:
    """Report uneven steps, unless the angles show that the samples were taken at their stamps.

    These are no fault: angles are filtered, and errors averaged, over time and not over samples.
    Where only the stamps are wrong, even ones mend the run.
    """
    explained, wrong = "take time from the device's clock, not from the host's", True
    if motion.measured_angle is not None:
        judged = _judged(motion, motion.measured_angle, on_grid)
        if judged is None:
            return
        explained, wrong = judged
    even = motion.time - (on_grid - on_grid[0]) / motion.sample_rate_hz
    yield Fault(
        FaultKind.CLOCK,
        motion.file,
        "time_s",
        f"clock jitter: irregular time steps, {100 * jitter:.2g} % of a sample period rms"
        f" ({1e3 * jitter / motion.sample_rate_hz:.2g} ms) off, all along; {explained}",
        samples=None if wrong else np.zeros(len(motion), dtype=bool),
        proof=by_motion(motion, mended(motion, even)) if wrong else None,
    )


def _judged(motion: Motion, angle: NDArray, on_grid: NDArray) -> tuple[str, bool] | None:
    """Return the meaning of uneven stamps, and whether they are wrong; None where they are right.

    The roughness of the angles (n, J) is compared with that due to stamps off their grid, (n,).
    Third differences hold noise of angles and of stamps, and no smooth motion.
    """
    rough = np.diff(angle, 3, axis=0)
    # An angle at uneven instants is rough: d angle = speed d t.
    stray = np.diff(on_grid / motion.sample_rate_hz, 3)[:, np.newaxis] * motion.dq[2:-1]
    whole = len(rough) // BLOCK * BLOCK
    # Neighbouring differences share samples; sums over so many are nearly independent.
    sums = np.sum(rough * stray, axis=1)[:whole].reshape(-1, BLOCK).sum(axis=1)
    scale = max(float(np.sum(stray**2)), np.finfo(float).tiny)
    # 1 where the samples were taken at the stamps, 0 where they were taken evenly.
    followed = float(np.sum(rough * stray)) / scale
    error = float(np.sqrt(len(sums)) * np.std(sums)) / scale
    if followed - SURE * error > HALF:
        return None
    if followed + SURE * error >= HALF:
        words = (
            "the angles are too coarse to show whether the stamps are right, so no sample is left"
            " out; better take time from the device's clock"
        )
        return words, False
    words = "the angles are smooth against the sample count, so only the stamps are wrong: rebuild"
    return f"{words} time_s from the device's counter and sample rate", True


def _rate(motion: Motion, on_grid: NDArray) -> Iterator[Fault]:
    """Report a clock that does not advance by one nominal period a sample."""
    if len(motion) < HORIZON:
        return
    # The median ignores spans with a late stamp.
    drift = float(np.median(on_grid[HORIZON:] - on_grid[:-HORIZON])) / HORIZON
    # A rate that changes within the run differs in median and mean: that is no wrong clock.
    overall = motion.sample_rate_hz / sample_rate(motion.time) - 1.0
    if min(abs(drift), abs(overall)) <= RATE:
        return
    fault = Fault(
        FaultKind.CLOCK,
        motion.file,
        "time_s",
        f"the clock runs at another rate than sample_rate_hz: {1.0 + drift:.4g} nominal"
        f" periods a sample, {motion.sample_rate_hz / (1.0 + drift):.5g} Hz in place of"
        f" {motion.sample_rate_hz:g} Hz; correct the wrong one",
        proof=by_motion(motion, mended(motion, motion.time[0] + _nominal(motion))),
    )
    # Where the nominal rate would make most of the error, it is the stamps that are right.
    if fault.ruling is not Ruling.REFUTED:
        yield fault


def _nominal(motion: Motion) -> NDArray:
    """Return times (n,) s from the first sample on, by the nominal rate."""
    return np.arange(len(motion)) / motion.sample_rate_hz
