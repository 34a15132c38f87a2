"""Order tracking: find lines of the residual torque over a joint's angle, and over time.

A gear's ripple is a line over the angle, at a number of cycles a turn. Its frequency rises and
falls with the joint's speed: no spectrum over time shows it. At 200 cycles a turn it lies above the
band that block averages pass, so the full sampling rate is needed. A hum is a line over time, which
no spectrum over the angle shows. Both spectra have the scale of ``line_spectrum`` (Fyfe, Munck,
1997, Mechanical Systems and Signal Processing 11(2): computed order tracking).

The strongest line of either kind is subtracted and the search repeated, so that hums, ripples and
their neighbours are not mistaken for one another. All lines together are refined by Gauss and
Newton's method. Those that are significant in addition to all others are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.line_spectrum import (
    Kind,
    Orders,
    Spectrum,
    information,
    nothing,
    spectrum_over_angle,
    spectrum_over_time,
)
from pipelines.diagnosis.evidence.whitened_residual import TINY, Channel, Grid, Trace, traces_of
from pipelines.effects import EFFECTS
from pipelines.mechanics.machine import THE_LEG, Machine
from pipelines.mechanics.motion import Motion

LEAST_WAVES = 4.0
"""Fewest waves within the swept angles: with fewer, a line is a smooth law of the angle."""
MOST_LINES = max(effect.most_parts for effect in EFFECTS if effect.order_tracked)
"""Largest number of lines of one kind at a joint."""


@dataclass(frozen=True)
class Line:
    """A sinusoid of the residual torque at one joint."""

    kind: Kind
    cycles: float
    """Cycles a turn (rad/m where the joint slides), or Hz."""
    amplitude: float
    """N·m, as in the torque channel; of a hum, the root mean square over runs."""
    phase: float
    """rad, of amplitude sin(n q + phase); NaN for a hum, whose phase differs from run to run."""
    log_likelihood_ratio: float
    """Of the line, in addition to all others, against noise of the same local colour."""
    false_alarm: float
    """Chance that noise alone shows such a line anywhere in the session."""


@dataclass(frozen=True)
class JointLines:
    """The lines of one joint's residual."""

    lines: tuple[Line, ...]
    """The significant ones of both kinds, the strongest first."""
    over_angle: Spectrum
    """Before any line was subtracted."""
    over_time: Spectrum

    def of_kind(self, kind: Kind) -> tuple[Line, ...]:
        """Return the lines of one kind, the strongest first."""
        return tuple(line for line in self.lines if line.kind is kind)


@dataclass(frozen=True)
class Sinusoids:
    """Lines of one kind, as fitted to r runs."""

    kind: Kind
    cycles: NDArray
    """(l,)."""
    amplitudes: NDArray
    """(r, l, 2) N·m of sine and cosine; over angle the same in all runs."""

    @classmethod
    def none(cls, kind: Kind, runs: int) -> "Sinusoids":
        """Return an empty set of lines."""
        return cls(kind, np.zeros(0), np.zeros((runs, 0, 2)))

    def __len__(self) -> int:
        """Return the number of lines."""
        return len(self.cycles)

    def with_one(self, cycles: float, amplitudes: NDArray) -> tuple["Sinusoids", "Sinusoids"]:
        """Return the lines and one more, with zero and with given amplitudes.

        Parameters
        ----------
        cycles : float
            Per turn, or Hz.
        amplitudes : (r, 1, 2) array
            Sine and cosine in each run, N·m.

        Returns
        -------
        tuple of Sinusoids
            With zero amplitudes, and with the given ones.
        """
        more = replace(self, cycles=np.append(self.cycles, cycles))
        sizes = (np.zeros_like(amplitudes), amplitudes)
        without, with_it = (np.concatenate([self.amplitudes, size], axis=1) for size in sizes)
        return replace(more, amplitudes=without), replace(more, amplitudes=with_it)

    def without(self, number: int) -> "Sinusoids":
        """Return all lines but one."""
        cycles = np.delete(self.cycles, number)
        return replace(self, cycles=cycles, amplitudes=np.delete(self.amplitudes, number, axis=1))

    def only(self, number: int) -> "Sinusoids":
        """Return one line."""
        amplitudes = self.amplitudes[:, number : number + 1]
        return replace(self, cycles=self.cycles[number : number + 1], amplitudes=amplitudes)

    def torque(self, waves: "_Waves", run: int) -> NDArray:
        """Return the torque of all lines in one run.

        Parameters
        ----------
        waves : _Waves
            Sines and cosines at the run's u usable samples.
        run : int
            Number of the run.

        Returns
        -------
        (u,) array
            N·m.
        """
        total = np.zeros(len(waves.grid.time))
        for cycles, (sine, cosine) in zip(self.cycles, self.amplitudes[run], strict=True):
            s, c = waves(self.kind, cycles)
            total += sine * s + cosine * c
        return total


def lines_in(motions: Sequence[Motion], residuals: Sequence[NDArray]) -> list[JointLines]:
    """Return the lines in the residual torque of some runs of one machine.

    Parameters
    ----------
    motions : sequence of Motion
        At the full sampling rate.
    residuals : sequence of (n, J) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    list of JointLines
        One for each joint, as of ``lines_of``.
    """
    machine = motions[0].machine
    each = [
        traces_of(motion, residual) for motion, residual in zip(motions, residuals, strict=True)
    ]
    bounds = [_orders(joint, machine) for joint in machine.names]
    return lines_of([list(traces) for traces in zip(*each, strict=True)], bounds)


def lines_of(
    joints: Sequence[Sequence[Trace]],
    bounds: Sequence[tuple[float, float]] | None = None,
) -> list[JointLines]:
    """Return the lines that each joint's residual has over its angle and over time.

    Parameters
    ----------
    joints : sequence of sequences of Trace
        For each joint its traces, one a run.
    bounds : sequence of (lowest, highest), optional
        Range of cycles a turn to search at each joint, rad/m where it slides; by default, the
        typical range of cogging on an exoskeleton.

    Returns
    -------
    list of JointLines
        One for each joint. Of sessions of noise alone, a share of ``FALSE_ALARMS`` shows any line.
    """
    bounds = bounds or [_orders(THE_LEG.names[0], THE_LEG)] * len(joints)
    searches = len(Kind) * len(joints)
    every = zip(joints, bounds, strict=True)
    return [_lines_of_joint(traces, ends, searches) for traces, ends in every]


def _orders(joint: str, machine: Machine) -> tuple[float, float]:
    """Return the range of cycles a turn of ripples at a joint, rad/m where it slides."""
    ripples = (effect for effect in EFFECTS if effect.order_tracked)
    ranges = [ripple(joint, on=machine).shape[0].typical for ripple in ripples]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _lines_of_joint(
    traces: Sequence[Trace],
    bounds: tuple[float, float],
    searches: int,
) -> JointLines:
    # Least usable motion in a run that is searched, s.
    least_s = 2.0
    moving = [trace for trace in traces if trace.usable.sum() >= least_s * trace.rate_hz]
    swept = _swept(moving)
    if not swept > 0.0:
        return JointLines((), nothing(Kind.ANGLE), nothing(Kind.TIME))
    # A joint that sweeps little needs more cycles a turn for the fewest waves.
    lowest, highest = bounds
    orders = Orders(swept, max(lowest, LEAST_WAVES * 2.0 * np.pi / swept), highest)
    search = _Search(moving, orders)
    lines = [Sinusoids.none(kind, len(moving)) for kind in Kind]
    channels = search.remainder(lines)
    first = spectra = [search.spectrum(kind, channels) for kind in Kind]
    tried: list[tuple[Kind, float]] = []
    while (place := _strongest(spectra, tried, searches)) is not None:
        tried.append(place)
        lines = search.refined(search.added(lines, *place, channels))
        if search.repeats(lines, place[0]):
            # A line whose size or phase changes with speed leaves a residual next to it: no line.
            lines = search.refined([lines[0].without(-1), lines[1]])
        channels = search.remainder(lines)
        spectra = [search.spectrum(kind, channels) for kind in Kind]
    # Each step holds the other kind of line, so all are refined once more at the end.
    if tried:
        lines = search.refined(lines)
        channels = search.remainder(lines)
    return JointLines(search.reported(lines, channels, spectra, searches), *first)


def _swept(traces: Sequence[Trace]) -> float:
    """Return the range of angles that a joint moves through, rad."""
    angles = [trace.angle[trace.usable] for trace in traces]
    return float(np.ptp(np.concatenate(angles))) if angles else 0.0


def _slow_hz(traces: Sequence[Trace], swept: float) -> float:
    """Return the frequency of ``LEAST_WAVES`` in the swept angles at the joint's usual speed."""
    speeds = np.concatenate([trace.speed[trace.usable] for trace in traces])
    usual = float(np.sqrt(np.mean(speeds**2)))
    # Least frequency that counts as slow, Hz.
    slowest_hz = 0.2
    return float(np.clip(LEAST_WAVES * usual / swept, slowest_hz, traces[0].rate_hz / 16.0))


class _Waves:
    """Sine and cosine of lines at a run's samples; the last few are kept, for use again."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._kept: dict[tuple[Kind, float], tuple[NDArray, NDArray]] = {}

    def __call__(self, kind: Kind, cycles: float) -> tuple[NDArray, NDArray]:
        """Return sine and cosine of a line, (u,) each."""
        if (kind, cycles) not in self._kept:
            grid = self.grid
            phase = cycles * (grid.angle if kind is Kind.ANGLE else 2.0 * np.pi * grid.time)
            if len(self._kept) > 2 * MOST_LINES:
                self._kept.pop(next(iter(self._kept)))
            self._kept[kind, cycles] = np.sin(phase), np.cos(phase)
        return self._kept[kind, cycles]


def _strongest(
    spectra: Sequence[Spectrum],
    tried: Sequence[tuple[Kind, float]],
    searches: int,
) -> tuple[Kind, float] | None:
    """Return kind and place of the strongest line worth a trial, away from those tried before."""
    best: tuple[float, Kind, float] | None = None
    # Largest chance of a false alarm of a line that is tried. Its significance is judged after the
    # other lines are subtracted.
    worth_a_trial = 0.3
    # Least distance between two lines of one kind, in widths.
    apart = 1.5
    for spectrum in spectra:
        ratio = spectrum.log_likelihood_ratio.copy()
        before = [cycles for kind, cycles in tried if kind is spectrum.kind]
        for cycles in before:
            # A line that was tried in vain would come first again, for ever.
            ratio[np.abs(spectrum.cycles - cycles) < apart * spectrum.width] = 0.0
        if len(before) >= MOST_LINES or not len(ratio):
            continue
        at = int(np.argmax(ratio))
        if spectrum.false_alarm(ratio[at], searches) > worth_a_trial:
            continue
        if best is None or ratio[at] > best[0]:
            best = float(ratio[at]), spectrum.kind, _peak(spectrum, at)
    return best and best[1:]


def _peak(spectrum: Spectrum, at: int) -> float:
    """Return the summit of the parabola through a maximum and its neighbours."""
    if not 0 < at < len(spectrum.cycles) - 1:
        return float(spectrum.cycles[at])
    shift = _summit(*spectrum.log_likelihood_ratio[at - 1 : at + 2])
    return float(spectrum.cycles[at] + shift * (spectrum.cycles[1] - spectrum.cycles[0]))


def _summit(before: float, here: float, after: float) -> float:
    """Return the summit of the parabola through three heights, in steps from the middle one."""
    bend = before - 2.0 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -1.0, 1.0)) if bend < 0.0 else 0.0


class _Search:
    """The search for lines at one joint."""

    def __init__(self, traces: Sequence[Trace], orders: Orders) -> None:
        slow_hz = _slow_hz(traces, orders.swept)
        self.waves = [_Waves(Grid.of(trace, slow_hz)) for trace in traces]
        self.orders = orders
        self.longest_s = max(float(np.ptp(waves.grid.time)) for waves in self.waves)
        # A hum has at least 1 Hz: below it, torque wanders.
        self.least_hz = max(1.0, 2.0 * slow_hz)

    def remainder(self, lines: Sequence[Sinusoids]) -> list[Channel]:
        """Return the residual in each run less the lines of each kind."""
        return [
            waves.grid.channel(waves.grid.residual - sum(kind.torque(waves, r) for kind in lines))
            for r, waves in enumerate(self.waves)
        ]

    def spectrum(self, kind: Kind, channels: Sequence[Channel]) -> Spectrum:
        """Return the spectrum of one kind."""
        if kind is Kind.TIME:
            return spectrum_over_time(channels, self.least_hz)
        return spectrum_over_angle(channels, self.orders)

    def added(
        self, lines: Sequence[Sinusoids], kind: Kind, cycles: float, channels: Sequence[Channel]
    ) -> list[Sinusoids]:
        """Return the lines of each kind with one more; its amplitudes come from the scores."""
        if kind is Kind.TIME:
            # Over a long run a small error of the frequency turns the phase.
            cycles = self._sharpened(cycles, channels)
        products = np.array(
            [
                [column @ channel.score for column in waves(kind, cycles)]
                for waves, channel in zip(self.waves, channels, strict=True)
            ]
        )
        information_of = np.array(
            # The mean square of a sine is one half.
            [0.5 * information(channel, kind, cycles) for channel in channels]
        )
        if kind is Kind.ANGLE:
            # A ripple has one phase in all runs, so their products add up first.
            products, information_of = (
                np.broadcast_to(products.sum(axis=0), products.shape),
                information_of.sum(),
            )
        amplitudes = (products.T / information_of).T[:, np.newaxis]
        of_kind = {known.kind: known for known in lines}
        of_kind[kind] = self._between(*of_kind[kind].with_one(cycles, amplitudes), channels)
        return list(of_kind.values())

    def _sharpened(self, hz: float, channels: Sequence[Channel]) -> float:
        """Return the frequency of a hum, from its power a quarter of a width to each side."""
        step = 0.25 / self.longest_s
        powers = [
            sum(
                abs(np.exp(2j * np.pi * x * waves.grid.time) @ channel.score) ** 2
                for waves, channel in zip(self.waves, channels, strict=True)
            )
            for x in (hz - step, hz, hz + step)
        ]
        return hz + step * _summit(*powers)

    def repeats(self, lines: Sequence[Sinusoids], kind: Kind) -> bool:
        """Return whether the last line over angle has moved next to another."""
        if kind is Kind.TIME:
            return False
        *others, last = lines[0].cycles
        return any(abs(last - other) < self.orders.width for other in others)

    def refined(self, lines: Sequence[Sinusoids]) -> list[Sinusoids]:
        """Return lines after a step of Gauss and Newton, of the length of highest likelihood."""
        channels = self.remainder(lines)
        over_angle, over_time = lines
        ahead = (
            _step_over_angle(over_angle, self.waves, channels, 0.25 * self.orders.width),
            _step_over_time(over_time, self.waves, channels),
        )
        return [self._between(now, then, channels) for now, then in zip(lines, ahead, strict=True)]

    def _between(
        self,
        now: Sinusoids,
        then: Sinusoids,
        channels: Sequence[Channel],
    ) -> Sinusoids:
        """Return the likeliest lines on the way from some lines to others, which may overshoot."""
        if not len(now):
            return now
        # Along the way the log likelihood is a parabola, and slope over bend its summit.
        slope = bend = TINY
        for r, (waves, channel) in enumerate(zip(self.waves, channels, strict=True)):
            torque = then.torque(waves, r) - now.torque(waves, r)
            slope += torque @ channel.score
            bend += torque @ channel.score_of(torque)
        # Longest step of a refinement, as a multiple of Gauss and Newton's.
        longest_step = 1.5
        share = float(np.clip(slope / bend, 0.0, longest_step))
        return replace(
            now,
            cycles=now.cycles + share * (then.cycles - now.cycles),
            amplitudes=now.amplitudes + share * (then.amplitudes - now.amplitudes),
        )

    def _ratio(self, line: Sinusoids, channels: Sequence[Channel]) -> float:
        """Return the log likelihood ratio of a line that was subtracted."""
        ratio = 0.0
        for r, (waves, channel) in enumerate(zip(self.waves, channels, strict=True)):
            torque = line.torque(waves, r)
            ratio += 0.5 * float(torque @ channel.score_of(torque))
        return ratio

    def reported(
        self,
        lines: Sequence[Sinusoids],
        channels: Sequence[Channel],
        spectra: Sequence[Spectrum],
        searches: int,
    ) -> tuple[Line, ...]:
        """Return the lines that are significant in addition to all others, the strongest first.

        The channels hold the residual less all lines.
        """
        significant = []
        # Chance that a session of noise alone shows any line.
        false_alarms = 0.005
        for known, spectrum in zip(lines, spectra, strict=True):
            # Lines are subtracted now, so near neighbours show a steep level that no line raises.
            level = spectrum.steep_level if len(known) else spectrum.level
            for number, cycles in enumerate(known.cycles):
                amplitudes = known.amplitudes[:, number]
                ratio = self._ratio(known.only(number), channels)
                ratio /= float(np.interp(cycles, spectrum.cycles, level))
                alarm = spectrum.false_alarm(ratio, searches)
                if alarm > false_alarms:
                    continue
                size = float(np.sqrt(np.mean(np.sum(amplitudes**2, axis=1))))
                # Over the angle all runs have the same amplitudes, so the first shows the phase.
                sine, cosine = amplitudes[0]
                phase = float(np.arctan2(cosine, sine)) if known.kind is Kind.ANGLE else np.nan
                significant.append(Line(known.kind, float(cycles), size, phase, ratio, alarm))
        significant.sort(key=lambda line: -line.log_likelihood_ratio)
        widths = {spectrum.kind: spectrum.width for spectrum in spectra}
        return tuple(
            line
            for i, line in enumerate(significant)
            if not _is_trace_of(line, significant[:i], widths)
        )


def _is_trace_of(line: Line, stronger: Sequence[Line], widths: dict[Kind, float]) -> bool:
    """Return whether a line is the residual of a stronger one whose size changes."""
    # Widths within which a line is a part of a stronger one, if it is much weaker.
    near = 5.0
    # Share of the stronger line's likelihood ratio below which a line is much weaker.
    much_weaker = 0.05
    return any(
        line.kind is other.kind
        and abs(line.cycles - other.cycles) < near * widths[line.kind]
        and line.log_likelihood_ratio < much_weaker * other.log_likelihood_ratio
        for other in stronger
    )


def _step_over_angle(
    lines: Sinusoids,
    waves: Sequence[_Waves],
    channels: Sequence[Channel],
    reach: float,
) -> Sinusoids:
    """Return lines over angle after a step along amplitudes and orders.

    An order moves by ``reach`` at most.
    """
    count = len(lines)
    if not count:
        return lines
    normal, right = np.zeros((3 * count, 3 * count)), np.zeros(3 * count)
    for wave, channel in zip(waves, channels, strict=True):
        grid = channel.grid
        columns = np.empty((3 * count, len(grid.angle)))
        for i, order in enumerate(lines.cycles):
            sine, cosine = lines.amplitudes[0, i]
            s, c = wave(Kind.ANGLE, order)
            # The third column is the derivative of the line's torque by its order.
            columns[3 * i : 3 * i + 3] = s, c, grid.angle * (sine * c - cosine * s)
        right += columns @ channel.score
        for i, order in enumerate(lines.cycles):
            # A sample is weighted by the noise at the frequency that the line has there.
            columns[3 * i : 3 * i + 3] *= np.sqrt(channel.weight(order * grid.hz_per_order))
        normal += columns @ columns.T
    change = _solved(normal, right).reshape(count, 3)
    cycles = lines.cycles + np.clip(change[:, 2], -reach, reach)
    return replace(lines, cycles=cycles, amplitudes=lines.amplitudes + change[:, :2])


def _step_over_time(
    lines: Sinusoids,
    waves: Sequence[_Waves],
    channels: Sequence[Channel],
) -> Sinusoids:
    """Return lines over time after a step along their amplitudes in each run."""
    if not len(lines):
        return lines
    # Frequencies stay: they were sharpened when each line was added.
    amplitudes = lines.amplitudes.copy()
    for r, (wave, channel) in enumerate(zip(waves, channels, strict=True)):
        columns = np.array([wave(Kind.TIME, hz) for hz in lines.cycles])
        weights = np.sqrt(channel.weight(lines.cycles))
        weighted = (columns * weights[:, np.newaxis, np.newaxis]).reshape(-1, columns.shape[2])
        right = columns.reshape(-1, columns.shape[2]) @ channel.score
        amplitudes[r] += _solved(weighted @ weighted.T, right).reshape(-1, 2)
    return replace(lines, amplitudes=amplitudes)


def _solved(normal: NDArray, right: NDArray) -> NDArray:
    """Return the least-norm solution of normal equations, (p, p) and (p,), columns scaled alike."""
    # Two lines next to each other make the equations singular, hence the least norm.
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    scaled = np.linalg.lstsq(normal / np.outer(size, size), right / size, rcond=1e-9)[0]
    return np.asarray(scaled / size)
