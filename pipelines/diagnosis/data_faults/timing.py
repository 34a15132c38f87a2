"""Time as stamped: samples that are missing, stamps that jitter, clocks at another rate, counters
that jump."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from pipelines.diagnosis.data_faults.fault import Fault
from pipelines.mechanics.motion import Motion

HORIZON = 50
"""Samples within which a late stamp is followed by one that is not."""
SINGLE = 3
"""Up to so many samples in a row count as dropped; more are a gap."""
JITTER = 0.04
"""Of a sample period, rms: steps that stray more are irregular. Moving at 1 rad/s, 4 % of 5 ms is
0.2 mrad, an encoder count."""
HALF, SURE = 0.5, 3.0
"""Share of the stamps' straying that angles follow, between none and all; standard errors."""
BELOW = 0.5
"""Of the angles' own noise: what wrong stamps do to the angles and is less adds an eighth to that
noise at most."""
BLOCK = 20
"""Samples whose sums are nearly independent."""
RATE = 0.01
"""Relative error of a clock that is worth a sentence: velocity is off by as much, acceleration by
twice."""


def timing_faults(motion: Motion) -> Iterator[Fault]:
    """Yield what is wrong with the time of one run."""
    late = motion.time * motion.sample_rate_hz - np.arange(len(motion))
    missing = missing_samples(motion, late)
    yield from _missing(motion, missing)
    yield from _counter(motion)
    on_grid = late - np.concatenate([[0.0], np.cumsum(missing)])
    jitter = float(np.std(np.diff(on_grid))) / np.sqrt(2.0)
    if jitter > JITTER:
        yield _irregular(motion, on_grid, jitter)
    yield from _rate(motion, on_grid)


def missing_samples(motion: Motion, late: NDArray) -> NDArray:
    """Return how many samples are missing before each but the first, (n - 1,) whole numbers.

    The counter knows. Without one: a missing sample leaves all that follow late, a late stamp only
    itself, so the step is looked for in the lower envelope of the lateness.

    Parameters
    ----------
    late : (n,) array
        Time in sample periods, less the sample's number.
    """
    if motion.sequence is not None:
        return np.maximum(_counted(motion.sequence) - 1, 0)
    ahead = minimum_filter1d(late, HORIZON, origin=-(HORIZON // 2), mode="nearest")
    return np.maximum(np.rint(np.diff(ahead)), 0.0).astype(np.int64)


def _counted(sequence: NDArray) -> NDArray:
    """Return by how many samples the counter advances, (n - 1,): who keeps each tenth row leaves a
    counter by tens."""
    step = np.diff(sequence)
    usual = max(int(np.median(step)), 1) if len(step) else 1
    return np.asarray(np.rint(step / usual).astype(np.int64))


def _missing(motion: Motion, missing: NDArray) -> Iterator[Fault]:
    # What is missing is left out already; the samples around it are as good as any.
    nothing_to_mask = np.zeros(len(motion), dtype=bool)
    long, few = missing > SINGLE, (missing > 0) & (missing <= SINGLE)
    if long.any():
        k = int(np.argmax(missing))
        yield Fault(
            motion.file,
            "time_s",
            f"{_count(long.sum(), 'gap')} in the recording, the longest of {missing[k]} missing"
            f" samples ({missing[k] / motion.sample_rate_hz:.2f} s) after {motion.time[k]:.2f} s:"
            " the fit leaves them out; record the run again if it repeats",
            nothing_to_mask,
        )
    if few.any():
        first, last = motion.time[:-1][few][[0, -1]]
        lost = int(missing[few].sum())
        yield Fault(
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
    step, time_step = _counted(motion.sequence), np.diff(motion.time) * motion.sample_rate_hz
    back, stands = step < 0, step == 0
    # A late stamp disagrees too, but by less than it takes to lose several samples.
    disagrees = (step > 0) & (np.abs(time_step - step) > SINGLE)
    for bad, what, remedy in (
        (back, "goes back", "the device restarted: split the file there"),
        (stands, "stands still", "samples were duplicated: drop the repeated rows"),
        (
            disagrees,
            "and time_s disagree by more than 3 samples",
            "find out which of the two clocks jumped",
        ),
    ):
        if bad.any():
            first = motion.time[1:][np.argmax(bad)]
            yield Fault(
                motion.file,
                "sequence",
                f"the sample counter {what} {_count(bad.sum(), 'time')}, first at {first:.2f} s:"
                f" {remedy}",
            )


def _irregular(motion: Motion, on_grid: NDArray, jitter: float) -> Fault:
    """Report uneven steps: they spoil a run where the angles contradict the stamps, or there are
    none to ask.

    Samples that were taken unevenly are as good as any where the stamps say when. Where the angles
    are too coarse to tell, what a wrong stamp does to them is too small to be seen as well; where
    they do tell, it may still be.
    """
    if motion.measured_angle is None:
        explained, spoils = "take time from the device's clock, not from the host's", True
    else:
        explained, spoils = _judged(_Asked.of(motion, motion.measured_angle, on_grid))
    return Fault(
        motion.file,
        "time_s",
        f"clock jitter: irregular time steps that stray by {100 * jitter:.2g} % of a sample period"
        f" rms ({1e3 * jitter / motion.sample_rate_hz:.2g} ms) all along; {explained}",
        None if spoils else np.zeros(len(motion), dtype=bool),
    )


@dataclass(frozen=True)
class _Asked:
    """What angles say of uneven stamps."""

    followed: float
    """1 where the samples were taken when the stamps say: an angle at uneven instants is rough, d
    angle = speed d t; 0 where they were taken evenly."""
    error: float
    """Standard error of ``followed``."""
    share: float
    """What the stamps' straying would do to an angle, over the angle's own noise; the largest of
    the joints."""

    @classmethod
    def of(cls, motion: Motion, angle: NDArray, on_grid: NDArray) -> "_Asked":
        """Compare the roughness of angles (n, J) with what stamps (n,), in sample periods off their
        grid, would make.

        Third differences hold what a smooth motion does not: noise of angles and of stamps.
        """
        rough = np.diff(angle, 3, axis=0)
        stray = np.diff(on_grid / motion.sample_rate_hz, 3)[:, np.newaxis] * motion.dq[2:-1]
        whole = len(rough) // BLOCK * BLOCK
        # Neighbouring differences share samples; sums over so many are nearly independent.
        sums = np.sum(rough * stray, axis=1)[:whole].reshape(-1, BLOCK).sum(axis=1)
        tiny = np.finfo(float).tiny
        scale = max(float(np.sum(stray**2)), tiny)
        return cls(
            followed=float(np.sum(rough * stray)) / scale,
            error=float(np.sqrt(len(sums)) * np.std(sums)) / scale,
            share=float(np.max(np.std(stray, axis=0) / np.maximum(np.std(rough, axis=0), tiny))),
        )


def _judged(asked: _Asked) -> tuple[str, bool]:
    """Say what uneven stamps mean, and whether they spoil the run."""
    if asked.followed - SURE * asked.error > HALF:
        return (
            "the angles follow the stamps: the samples were taken then, and nothing is lost",
            False,
        )
    if asked.followed + SURE * asked.error >= HALF:
        return (
            (
                "the angles are too coarse to tell whether the stamps are right, and so to suffer"
                " where they are not: no sample is left out; better take time from the device's"
                " clock"
            ),
            False,
        )
    reason = "the angles are smooth against the sample count, so only the stamps are wrong: "
    if asked.share < BELOW:
        return (
            (
                f"{reason}by {100 * asked.share:.2g} % of the angles' own noise at most, and"
                " nothing is lost"
            ),
            False,
        )
    return f"{reason}rebuild time_s from the device's counter and sample rate", True


def _rate(motion: Motion, on_grid: NDArray) -> Iterator[Fault]:
    """Report a clock that does not advance by one nominal period a sample."""
    if len(motion) < HORIZON:
        return
    drift = float(np.median(on_grid[HORIZON:] - on_grid[:-HORIZON])) / HORIZON
    # A rate that changes within the run has another median than mean; its clock is none the worse.
    overall = float(on_grid[-1] - on_grid[0]) / (len(motion) - 1)
    if min(abs(drift), abs(overall)) > RATE:
        yield Fault(
            motion.file,
            "time_s",
            f"the clock runs at another rate than sample_rate_hz says: {1.0 + drift:.4g} nominal"
            f" periods a sample, {motion.sample_rate_hz / (1.0 + drift):.5g} Hz in place of"
            f" {motion.sample_rate_hz:g} Hz; correct the one that is wrong",
        )
