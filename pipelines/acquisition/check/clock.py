"""Whether a device's sample counter and clock run at the expected rates."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.interpretation import remedy
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.modbus.wraparound import CLOCK_TOLERANCE, RATE_TOLERANCE
from pipelines.settings.rig.register import DIMENSION, UNITS


@dataclass(frozen=True)
class Clock:
    """Rates of a device's counter and clock."""

    counter_hz: float | None
    """Samples a second of the host's clock; None in lockstep, and if it stands still."""
    clock_rate: float | None
    """Seconds of the device's clock in a second; None without a clock."""
    step: float
    """Typical step of the counter."""


def measure_clock(probe: Probe, series: Series, seconds: float) -> Clock:
    """Measure counter and clock from the first answer to the last.

    Parameters
    ----------
    probe : Probe
        The device.
    series : Series
        Its answers.
    seconds : float
        Time between first and last answer, host's clock, s.

    Returns
    -------
    Clock
        Rates in Hz, or None where they are unknown, and the usual step of the counter.
    """
    counter = series.of("sequence", counts=True)
    steps = np.diff(counter)
    # Repeated answers of one sample show no step of the counter.
    steps = steps[steps != 0]
    moved = float(counter[-1] - counter[0])
    clock_rate = None
    if "time" in series.block.registers and seconds > 0:
        time = series.of("time", counts=True)
        clock_rate = float(time[-1] - time[0]) / seconds
    return Clock(
        moved / seconds if moved and not probe.in_lockstep else None,
        clock_rate,
        float(np.median(steps)) if len(steps) else 0.0,
    )


def check_clock(
    probe: Probe, series: Series, clock: Clock, seconds: float, rate_hz: float | None
) -> Iterator[Finding]:
    """Yield findings about the counter, or about the clock if the counter is right.

    Parameters
    ----------
    series : Series
        Answers over a second or more, several of each sample where the line is fast enough.
    seconds : float
        Time from the first answer to the last; in lockstep that of the samples.
    rate_hz : float, optional
        Expected samples a second; in lockstep each step is one.
    """
    findings = list(_check_counter(probe, series, clock, seconds, rate_hz))
    yield from findings
    if not findings and "time" in series.block.registers:
        yield from _check_time(probe, series, clock, seconds)


def _check_counter(
    probe: Probe, series: Series, clock: Clock, seconds: float, rate_hz: float | None
) -> Iterator[Finding]:
    # Fewest steps, and their share of all, from which the device itself counts so.
    enough, majority = 3, 0.5
    counter, where = series.of("sequence", counts=True), f"{probe.map_path}.read.sequence"
    steps = np.diff(counter)
    measured_hz = (counter[-1] - counter[0]) / seconds
    if _counts(counter, seconds, rate_hz):
        # Several samples may have come between two answers that are far apart.
        possible = 1.0 + measured_hz * (series.answered[1:] - series.asked[:-1])
        too_large = np.count_nonzero(steps > possible)
        is_its_own = too_large >= max(enough, majority * np.count_nonzero(steps))
        if clock.step > 1 and not probe.in_lockstep and is_its_own:
            yield probe.finding(
                f"its counter goes up by {clock.step:g} at a time, expected 1 for each sample;"
                f" correct {where}.scale, or let the device count samples",
                "sequence",
            )
        return
    mended = remedy(
        "sequence", "", where, series, lambda v: _counts(v, seconds, rate_hz), counts=True
    )
    expected = f"{rate_hz:g}" if rate_hz else "a sample rate"
    otherwise = f"is it sampling? Set its rate or acquire.sample_rate_hz, or correct {where}"
    yield probe.finding(
        f"its counter goes up by {measured_hz:.4g} a second, from {counter[0]:.6g} to"
        f" {counter[-1]:.6g}, expected {expected}; {mended or otherwise}",
        "sequence",
    )


def _counts(counter: NDArray, seconds: float, rate_hz: float | None) -> bool:
    """Return whether a counter (n,) increases, at the expected rate if one is known."""
    if not np.isfinite(counter).all() or (np.diff(counter) < 0).any():
        return False
    measured = (counter[-1] - counter[0]) / seconds
    if rate_hz is None:
        return bool(0.5 <= measured <= 1e5)  # a credible sample rate
    # A sample more or less at either end.
    return bool(abs(measured - rate_hz) <= RATE_TOLERANCE * rate_hz + 2.0 / seconds)


def _check_time(probe: Probe, series: Series, clock: Clock, seconds: float) -> Iterator[Finding]:
    time, where = series.of("time", counts=True), f"{probe.map_path}.read.time"
    # Of the first and the last answer, it is not known when in a request they were read.
    late_s = float(np.max((series.answered - series.asked)[[0, -1]]))
    if _keeps_time(time, seconds, late_s):
        return
    register, rate = series.block.registers["time"], clock.clock_rate or 0.0
    reference = "by its counter" if probe.in_lockstep else "of this computer's clock"
    measured = f"its clock goes on by {rate:.4g} s in each second {reference}"
    for unit in DIMENSION["time"]:
        if unit == register.unit or not rate:
            continue
        if abs(rate * UNITS[unit] / UNITS[register.unit] - 1.0) <= RATE_TOLERANCE:
            yield probe.finding(
                f'{measured}; with unit = "{unit}" the two agree: correct {where}', "time"
            )
            return
    mended = remedy(
        "time", " s", where, series, lambda v: _keeps_time(v, seconds, late_s), counts=True
    )
    scale = f"{register.scale / rate:.3g} would agree" if rate > 0 else "no scale would agree"
    otherwise = f"compare {where} with the manual: scale = {scale}"
    yield probe.finding(f"{measured}; {mended or otherwise}", "time")


def _keeps_time(time: NDArray, seconds: float, late_s: float = 0.0) -> bool:
    if not np.isfinite(time).all() or (np.diff(time) < 0).any():
        return False
    steps = np.diff(time)
    # A sample more or less at either end; the median, as a single leap must not allow itself.
    sample = float(np.median(steps[steps > 0])) if steps.any() else 0.0
    error_s = CLOCK_TOLERANCE * seconds + 2.0 * sample + late_s
    return bool(abs(time[-1] - time[0] - seconds) <= error_s)


def check_latch(probe: Probe, series: Series) -> Iterator[Finding]:
    """Yield a finding if registers that are not latched change while the counter does not.

    Parameters
    ----------
    probe : Probe
        The device.
    series : Series
        Its answers.

    Yields
    ------
    Finding
        At most one, with the names of the registers.
    """
    if len(series.fresh) < 2:  # this needs a counter that counts
        return
    is_same_sample = (np.diff(series.raw("sequence"), axis=0) == 0).all(axis=1)
    torn = [
        name
        for name in series.block.names
        # A status word may change at any time, as it shows the present state.
        if name not in ("sequence", "status")
        and np.diff(series.raw(name), axis=0)[is_same_sample].any()
    ]
    if torn:
        yield probe.finding(
            f"{', '.join(torn)} changed while the sample counter did not: a block is not latched at"
            " one instant; read the registers that the device latches, see its manual",
        )
