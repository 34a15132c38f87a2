"""Noise, distortion and change over time at the lines of a multisine, without any cause.

What differs between the periods of a periodic motion is noise. At even lines only an even
nonlinearity makes a torque that repeats, at empty odd lines only an odd one. Source: R. Pintelon
and J. Schoukens (2012), System Identification: A Frequency Domain Approach, 2nd edition, Wiley,
sections 4.3 and 5.

It describes the same samples as the posterior, so it is no evidence in addition to that.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.signals.sampling import whole_periods

BAND_LINES = 8
"""Lines next to each other whose noise is taken for equally strong."""
PAST = 1
"""Past blocks from which noise is predicted."""
LARGEST_SHARE = 0.7
"""Most coefficients of lines per sample."""
LEAST_VALID = 0.9
"""Least share of valid blocks in a run whose periods are compared."""
CLASSES = ("excited", "odd", "even")
"""Lines by what can repeat there: the motion, odd distortion, even distortion."""


@dataclass(frozen=True)
class ByClass:
    """A number for each class of lines."""

    excited: float
    odd: float
    even: float


@dataclass(frozen=True)
class JointDetectionLines:
    """Noise and distortion of one joint's torque, N·m.

    Measured and predicted rms are up to ``highest_hz``; those of the residual are up to the highest
    line that its samples away from reversals determine, which is lower.
    """

    runs: int
    periods: int
    """Of all runs together."""
    highest_hz: float
    noise_nm: float
    """Of the measured torque, in one period."""
    measured_nm: ByClass
    """Part that repeats from period to period, without noise."""
    predicted_nm: ByClass
    """The same of the baseline: gravity and friction distort by themselves."""
    residual_nm: ByClass
    """The same of measured less predicted torque, away from reversals."""
    p_value: ByClass
    """Of the residual: that it is no more than noise."""
    extended_residual_nm: ByClass | None
    """With the named causes; None without any."""
    extended_p_value: ByClass | None
    change_nm: float | None
    """Steady change of the residual's lines from the first period of a run to its last; None
    without a run of three periods."""
    change_p_value: float | None


@dataclass(frozen=True)
class PeriodLines:
    """The lines of P whole periods of one signal at one joint."""

    amplitude: NDArray
    """(P, K) complex; the squared size is a line's share of the mean square."""
    excited: frozenset[int]
    base_hz: float
    mean_variance: float
    """Variance of the mean over periods, times P, per variance of one period: more than one where
    samples are missing."""
    scatter: float
    """Expected scatter over periods per variance of one period: less than one there."""

    @property
    def periods(self) -> int:
        """Number of whole periods, P."""
        return len(self.amplitude)

    @property
    def lines(self) -> NDArray:
        """Numbers of the lines, (K,)."""
        return np.arange(1, self.amplitude.shape[1] + 1)

    @property
    def mean(self) -> NDArray:
        """Mean over the periods, (K,) complex."""
        return np.asarray(self.amplitude.mean(axis=0))

    @cached_property
    def variance(self) -> NDArray:
        """Variance of the noise in one period at each line, (K,)."""
        deviation = np.abs(self.amplitude - self.mean) ** 2
        return np.asarray(deviation.sum(axis=0) / (self.periods - 1) / self.scatter)

    @property
    def level(self) -> float:
        """Mean variance of a line's noise in one period."""
        return float(self.variance.mean())

    def of_class(self, name: str) -> NDArray:
        """Return which lines belong to a class, (K,) bool."""
        excited = np.isin(self.lines, list(self.excited))
        if name == "excited":
            return excited
        return ~excited & (self.lines % 2 == (1 if name == "odd" else 0))

    def repeating(self, chosen: NDArray) -> float:
        """Return the mean square of what repeats at some lines (K,) bool, without noise.

        It may be negative by chance.
        """
        noise = self.variance * self.mean_variance / self.periods
        return float(np.sum((np.abs(self.mean) ** 2 - noise)[chosen]))


@dataclass(frozen=True)
class LineSpectrum:
    """Rms of each line of one joint's torque, averaged over some runs; K lines."""

    hz: NDArray
    """(K,)."""
    classes: NDArray
    """(K,) of ``CLASSES``."""
    measured_nm: NDArray
    """(K,) mean over the periods of a run."""
    predicted_nm: NDArray
    """(K,) the baseline's."""
    noise_nm: NDArray
    """(K,) standard deviation of such a mean."""


def line_spectrum(
    runs: Sequence[Run], residuals: Sequence[NDArray], joint: int
) -> LineSpectrum | None:
    """Return the spectrum of one joint's torque and of its prediction, of samples at reversals too.

    Parameters
    ----------
    runs : sequence of Run
        Those with the lines of the first that has detection lines are used.
    residuals : sequence of (m, O) arrays
        Measured torque less the baseline's, N·m.
    joint : int
        Number of the joint.
    """
    both = []
    for run, residual in zip(runs, residuals, strict=True):
        torque = run.measured[:, joint]
        measured = Periods.of(run, torque)
        predicted = Periods.of(run, torque - residual[:, joint])
        if measured and predicted:
            both.append((measured.lines(), predicted.lines()))
    if not both:
        return None
    first = both[0][0]
    alike = [
        pair
        for pair in both
        if (pair[0].base_hz, pair[0].excited) == (first.base_hz, first.excited)
    ]
    lines = np.arange(1, min(len(one.lines) for one, _ in alike) + 1)
    powers = [
        (np.abs(m.mean) ** 2, np.abs(p.mean) ** 2, m.variance * m.mean_variance / m.periods)
        for m, p in alike
    ]
    cut = np.array([[power[: len(lines)] for power in of_run] for of_run in powers])
    measured_nm, predicted_nm, noise_nm = np.sqrt(cut.mean(axis=0))
    kinds = np.select([first.of_class(name)[: len(lines)] for name in CLASSES], CLASSES, default="")
    return LineSpectrum(lines * first.base_hz, kinds, measured_nm, predicted_nm, noise_nm)


def detection_lines(
    runs: Sequence[Run], residuals: Sequence[NDArray], extended: Sequence[NDArray] | None
) -> list[JointDetectionLines | None]:
    """Return what the lines of all runs together show at each joint.

    Parameters
    ----------
    runs : sequence of Run
        Training and validation runs: a fit takes from the residual of the former on average as
        much noise as it adds to that of the latter.
    residuals : sequence of (m, O) arrays
        Measured torque less the baseline's, N·m.
    extended : sequence of (m, O) arrays or None
        The same with the named causes, if there are any.

    Returns
    -------
    list of JointDetectionLines or None
        None for a joint without a run that has detection lines, two whole periods and few gaps.
    """
    joints = len(runs[0].motion.joints)
    return [_of_joint(j, runs, residuals, extended) for j in range(joints)]


def _of_joint(
    j: int, runs: Sequence[Run], residuals: Sequence[NDArray], extended: Sequence[NDArray] | None
) -> JointDetectionLines | None:
    if not runs[0].motion.machine.measured[j]:
        return None

    def lines(values: Sequence[NDArray]) -> list[PeriodLines]:
        of_runs = [Periods.of(run, x[:, j]) for run, x in zip(runs, values, strict=True)]
        return [one.lines() for one in of_runs if one is not None]

    torque = [run.measured for run in runs]
    predicted = [m - r for m, r in zip(torque, residuals, strict=True)]
    measured = lines(torque)
    residual, white = residual_lines(runs, [r[:, j] for r in residuals], j)
    if not measured or not residual:
        return None
    rest = None
    if extended is not None:
        rest = residual_lines(runs, [r[:, j] for r in extended], j)
    change = changes(residual, white)
    return JointDetectionLines(
        runs=len(measured),
        periods=sum(one.periods for one in measured),
        highest_hz=max(len(one.lines) * one.base_hz for one in measured),
        noise_nm=float(np.sqrt(np.mean([one.variance.sum() for one in measured]))),
        measured_nm=_rms(measured),
        predicted_nm=_rms(lines(predicted)),
        residual_nm=_rms(residual),
        p_value=p_values(white),
        extended_residual_nm=_rms(rest[0]) if rest else None,
        extended_p_value=p_values(rest[1]) if rest else None,
        change_nm=change[0] if change else None,
        change_p_value=change[1] if change else None,
    )


@dataclass(frozen=True)
class Periods:
    """P whole periods of one signal, on N phases."""

    values: NDArray
    """(P, N) N·m."""
    known: NDArray
    """(P, N) bool; what is missing is filled from the other periods."""
    block: NDArray
    """(P, N) number of the nearest block."""
    excited: frozenset[int]
    base_hz: float
    highest: int
    """Number of the highest line."""

    @classmethod
    def of(cls, run: Run, values: NDArray) -> "Periods | None":
        """Return the whole periods of a signal.

        Parameters
        ----------
        run : Run
            m blocks.
        values : (m,) array
            N·m.

        Returns
        -------
        Periods or None
            None without detection lines, two whole periods, or most of their samples.
        """
        motion, time = run.motion, run.time
        excited, period_s = motion.metadata.get("excited_lines"), motion.period_s
        if not excited or not period_s or run.valid.sum() < 2:
            return None
        step = run.block.decimation / motion.sample_rate_hz
        good = time[run.valid]
        # Valid samples alone, where that costs no period.
        span = good if _whole(good, step, period_s) == _whole(time, step, period_s) else time
        # An even number of phases has for each another one half a period later.
        periods, phases = _whole(span, step, period_s), 2 * int(np.ceil(0.5 * period_s / step))
        highest = int(min(run.bandwidth_hz, motion.cutoff_hz) * period_s)
        if periods < 2 or highest < max(excited):
            return None
        at = span[0] + period_s * np.arange(periods * phases) / phases
        near = np.clip(np.searchsorted(time, at - 0.5 * step), 0, len(time) - 1)
        there = (np.abs(time[near] - at) < step) & run.valid[near]
        if there.mean() < LEAST_VALID:
            return None
        x = np.interp(at, good, values[run.valid]).reshape(periods, phases)
        known = there.reshape(periods, phases)
        count = known.sum(axis=0)
        # What is missing in one period is as in the others, and where all lack it, as in between.
        mean = np.where(known, x, 0.0).sum(axis=0) / np.maximum(count, 1)
        return cls(
            np.where(known | (count == 0), x, mean),
            known,
            near.reshape(periods, phases),
            frozenset(int(k) for k in excited),
            1.0 / period_s,
            min(highest, (phases - 1) // 2),
        )

    def away_from_reversals(self, usable: NDArray) -> NDArray:
        """Return which phases are usable in every period, and half a period later, (N,) bool.

        The mirrored half of the motion reverses at the same phases. With such gaps, even and odd
        lines remain orthogonal.

        Parameters
        ----------
        usable : (m,) array of bool
            Of each block.
        """
        kept = np.all(usable[self.block] | ~self.known, axis=0)
        return np.asarray(kept & np.roll(kept, len(kept) // 2))

    def lines(self) -> PeriodLines:
        """Return the Fourier coefficients of all samples."""
        spectrum = np.fft.rfft(self.values, axis=1)[:, 1 : self.highest + 1]
        every = np.ones(self.values.shape[1], dtype=bool)
        return self._lines(np.sqrt(2.0) * spectrum / len(every), every)

    def lines_at(self, kept: NDArray) -> PeriodLines | None:
        """Return the coefficients of orthonormal lines on some phases, the excited ones first.

        What the excited lines explain is not left to the others, and white noise remains white.

        Parameters
        ----------
        kept : (N,) array of bool
            Phases that count.

        Returns
        -------
        PeriodLines or None
            None where these phases are too few.
        """
        # Lines of more coefficients than samples would not be independent.
        highest = min(self.highest, int(LARGEST_SHARE * kept.sum() / 2.0))
        if highest < max(self.excited):
            return None
        order = sorted(range(1, highest + 1), key=lambda k: (k not in self.excited, k))
        wave = np.exp(2j * np.pi * np.outer(np.flatnonzero(kept) / len(kept), order))
        pairs = np.stack([wave.real, wave.imag], axis=2).reshape(len(wave), -1)
        # A constant is an offset, and no distortion.
        basis = np.linalg.qr(np.column_stack([np.ones(len(wave)), pairs]))[0][:, 1:]
        coefficients = self.values[:, kept] @ basis / np.sqrt(kept.sum())
        amplitude = np.empty((len(coefficients), highest), dtype=complex)
        amplitude[:, np.array(order) - 1] = coefficients[:, 0::2] + 1j * coefficients[:, 1::2]
        return self._lines(amplitude, kept)

    def whitened(self, past: NDArray) -> "Periods":
        """Return the periods less their prediction by past samples.

        Parameters
        ----------
        past : (p,) array
            Coefficients of an autoregression.
        """
        x = self.values.ravel()
        predicted = np.column_stack([np.roll(x, i + 1) for i in range(len(past))]) @ past
        return replace(self, values=(x - predicted).reshape(self.values.shape))

    def _lines(self, amplitude: NDArray, kept: NDArray) -> PeriodLines:
        periods = len(amplitude)
        count = np.maximum(self.known.sum(axis=0)[kept], 1)
        return PeriodLines(
            amplitude,
            self.excited,
            self.base_hz,
            mean_variance=float(periods * np.mean(1.0 / count)),
            scatter=float(np.mean(count - 1.0) / (periods - 1.0)),
        )


def residual_lines(
    runs: Sequence[Run], residuals: Sequence[NDArray], joint: int
) -> tuple[list[PeriodLines], list[PeriodLines]]:
    """Return the lines of a joint's residual away from its reversals, plain and whitened.

    Gaps spread a strong line of coloured noise to all others, so that only whitened lines have
    independent noise. The noise is what differs between periods.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m,) arrays
        N·m.
    joint : int
        Number of the joint.
    """
    plain, white = [], []
    every = [(run, Periods.of(run, x)) for run, x in zip(runs, residuals, strict=True)]
    periods = [(one, one.away_from_reversals(run.usable[:, joint])) for run, one in every if one]
    past = _autoregression(periods)
    for one, kept in periods:
        # A prediction needs past samples away from reversals as well.
        known_past = _with_past(kept)
        lines, whitened = one.lines_at(kept), one.whitened(past).lines_at(known_past)
        if lines is not None and whitened is not None:
            plain.append(lines)
            white.append(whitened)
    return plain, white


def _with_past(kept: NDArray) -> NDArray:
    """Return the phases (N,) whose past samples are kept, too."""
    return np.all([np.roll(kept, i) for i in range(PAST + 1)], axis=0)


def _autoregression(periods: Sequence[tuple[Periods, NDArray]]) -> NDArray:
    """Fit an autoregression to what differs between periods, (PAST,)."""
    rows, targets = [], []
    for one, kept in periods:
        deviation = one.values - one.values.mean(axis=0)
        chosen = np.tile(_with_past(kept), len(deviation))
        x = deviation.ravel()
        rows.append(np.column_stack([np.roll(x, i + 1)[chosen] for i in range(PAST)]))
        targets.append(x[chosen])
    if not rows:
        return np.zeros(PAST)
    return np.asarray(np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=None)[0])


def _whole(time: NDArray, step: float, period_s: float) -> int:
    return whole_periods(float(time[-1] - time[0]), step, period_s)


def _rms(of_runs: Sequence[PeriodLines]) -> ByClass:
    """Return the rms of what repeats in each class, averaged over the runs."""
    powers = [[one.repeating(one.of_class(name)) for one in of_runs] for name in CLASSES]
    return ByClass(*(float(np.sqrt(max(float(np.mean(power)), 0.0))) for power in powers))


@dataclass(frozen=True)
class _Squares:
    """Squares at the lines of one run, each of expectation one under noise alone."""

    values: NDArray
    """(K,)."""
    times: float
    """Number of independent squares that each value is the mean of."""


def p_values(of_runs: Sequence[PeriodLines]) -> ByClass:
    """Return for each class the p-value of the hypothesis that nothing but noise repeats there.

    In each band of neighbouring lines an F test compares what repeats with the scatter over the
    periods. The smallest p-value of the bands counts, corrected for their number (Tippett).

    Parameters
    ----------
    of_runs : sequence of PeriodLines
        Of one joint, whitened.

    Returns
    -------
    ByClass
        From 0 to 1.
    """
    # Whitened noise is equally strong at all lines; runs may differ.
    above = [
        _Squares(one.periods * np.abs(one.mean) ** 2 / one.mean_variance / one.level, 1.0)
        for one in of_runs
    ]
    below = [_Squares(one.variance / one.level, one.periods - 1.0) for one in of_runs]
    return ByClass(
        *(
            _smallest_p(of_runs, above, below, [one.of_class(name) for one in of_runs])
            for name in CLASSES
        )
    )


def changes(
    of_runs: Sequence[PeriodLines], white: Sequence[PeriodLines]
) -> tuple[float, float] | None:
    """Return the rms of a steady change within a run, N·m, and its p-value against noise.

    A change makes distant periods differ more than adjacent ones. None without a run of three
    periods.

    Parameters
    ----------
    of_runs, white : sequence of PeriodLines
        Of one joint, plain and whitened.
    """
    long = [one for one in white if one.periods > 2]
    if not long:
        return None
    above, below = [], []
    for one in long:
        trend, remainder = _trend(one)
        above.append(_Squares(trend / one.level, 1.0))
        below.append(_Squares(remainder / one.level, one.periods - 2.0))
    everywhere = [np.ones(len(one.lines), dtype=bool) for one in long]
    powers = []
    for one in of_runs:
        if one.periods > 2:
            trend, remainder = _trend(one)
            order = _order(one)
            # From the first period to the last.
            powers.append((one.periods - 1.0) ** 2 / (order @ order) * np.sum(trend - remainder))
    rms = float(np.sqrt(max(np.mean(powers), 0.0)))
    return rms, _smallest_p(long, above, below, everywhere)


def _order(one: PeriodLines) -> NDArray:
    """Return the numbers of the periods, (P,), about their mean."""
    return np.arange(one.periods) - 0.5 * (one.periods - 1)


def _trend(one: PeriodLines) -> tuple[NDArray, NDArray]:
    """Return the squares (K,) of a steady change and of the rest, of equal expectation in noise."""
    order = _order(one)
    trend = np.abs(order @ one.amplitude) ** 2 / (order @ order)
    remainder = np.sum(np.abs(one.amplitude - one.mean) ** 2, axis=0) - trend
    return np.asarray(trend), np.asarray(remainder / (one.periods - 2.0))


def _smallest_p(
    of_runs: Sequence[PeriodLines],
    numerators: Sequence[_Squares],
    denominators: Sequence[_Squares],
    chosen: Sequence[NDArray],
) -> float:
    """Return the smallest p-value of F tests in bands of lines, corrected for their number.

    Parameters
    ----------
    of_runs : sequence of PeriodLines
        Whose sums of squares add up.
    numerators, denominators : sequence of _Squares
        Of each run.
    chosen : sequence of (K,) bool arrays
        Lines of the numerator; the denominator has all lines of the band.
    """
    bands = max(-(-len(one.lines) // BAND_LINES) for one in of_runs)
    # For numerator and denominator: sum of squares, and their number.
    sums = np.zeros((2, 2, bands))
    for one, *both, own in zip(of_runs, numerators, denominators, chosen, strict=True):
        band, every = (one.lines - 1) // BAND_LINES, np.ones(len(one.lines), dtype=bool)
        for total, squares, used in zip(sums, both, (own, every), strict=True):
            total[0] += squares.times * np.bincount(band[used], squares.values[used], bands)
            total[1] += squares.times * np.bincount(band[used], minlength=bands)
    there = np.all(sums > 0.0, axis=(0, 1))
    if not there.any():
        return 1.0
    (above, above_count), (below, below_count) = sums[:, :, there]
    ratio = above / above_count / (below / below_count)
    # Each square has a real and an imaginary part.
    p = f_distribution.sf(ratio, 2.0 * above_count, 2.0 * below_count).min()
    # One minus the probability that no band is as extreme.
    return float(-np.expm1(there.sum() * np.log1p(-p))) if p < 1.0 else 1.0
