"""Search a cause's shapes coarsely: a grid, screened at block rate in the decision band."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import (
    ALWAYS,
    TURNS,
    Candidate,
    lowest,
    transforms_motion,
)
from pipelines.diagnosis.candidates.shape_refinement import (
    TONE_STEP_HZ,
    CandidateFit,
    ShapeRefinement,
)
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import Effect, Parameter

BENDING = 2
"""Values of a shape parameter to which the effect is nearly proportional."""


def screened(
    effect: Effect, alone: ShapeRefinement, runs: Sequence[Run], regression: DecisionRegression
) -> list[CandidateFit]:
    """Return the fits of an effect's grid.

    Parameters
    ----------
    effect : Effect
        Bound to its joint.
    alone : ShapeRefinement
        The baseline's rows alone.
    runs : sequence of Run
        The searched runs.
    regression : DecisionRegression
        Its rows.

    Returns
    -------
    list of CandidateFit
        Those that explain most first.
    """
    chosen = effect.directions([run.motion for run in runs])
    if chosen:
        # A candidate has a column for each direction to which its effect is proportional.
        starts = [Candidate(effect, (some[0],) * len(runs), tuple(some)) for some in chosen]
    elif any(p.per_run for p in effect.shape) and not transforms_motion(effect):
        starts = [_from_the_start(effect, len(runs))]
    else:
        starts = [
            Candidate(effect, (shape,) * len(runs)) for shape in _grid(effect, runs, regression)
        ]
    # The best stiffness depends on the rigid bodies behind the spring, so both kinds are tried.
    if effect.swings:
        fits = [fitted for start in starts for fitted in alone.fits_of_transmission(start)]
    else:
        fits = [fitted for start in starts if (fitted := alone.fit(start)) is not None]
    return sorted(fits, key=lambda fitted: -fitted.score)


def others_of(fits: Sequence[CandidateFit], chosen: CandidateFit, most: int) -> list[CandidateFit]:
    """Return the best fits at other forms or other maxima than the chosen fit.

    Parameters
    ----------
    fits : sequence of CandidateFit
        Fits of one effect, the best first.
    chosen : CandidateFit
        The fit to differ from.
    most : int
        Greatest number of results.
    """
    effect = chosen.candidate.effect
    kept = [chosen]
    for fitted in fits:
        if len(kept) > most:
            break
        if all(_differ(effect, fitted.candidate, k.candidate) for k in kept):
            kept.append(fitted)
    return kept[1:]


def _differ(effect: Effect, one: Candidate, other: Candidate) -> bool:
    """Return whether two shapes differ by more than a refinement can follow."""
    # Least distance between two maxima along an oscillating parameter, in grid steps.
    grid_steps = 2
    for parameter, a, b in zip(effect.shape, one.shapes[0], other.shapes[0], strict=True):
        low, high = parameter.typical
        if parameter.forms:
            apart = a != b
        elif parameter.unit in {"Hz", *TURNS}:
            step = TONE_STEP_HZ if parameter.unit == "Hz" else parameter.grain
            apart = abs(a - b) > grid_steps * step
        else:
            apart = abs(a - b) > 0.4 * (high - low)
        if apart:
            return True
    return False


def _grid(
    effect: Effect, runs: Sequence[Run], regression: DecisionRegression
) -> Iterator[tuple[float, ...]]:
    """Yield the shapes to try."""
    # Values of a shape parameter in a grid.
    most = 8
    # A rhythm has too many maxima for a grid. A periodogram shows all of them at once.
    if [p.unit for p in effect.shape] == ["Hz"]:
        yield from ((f,) for f in _rhythms(effect, runs, regression)[:most])
        return
    few = BENDING if transforms_motion(effect) and not effect.swings else most
    yield from itertools.product(*(_tried(effect, p, few, runs) for p in effect.shape))


def _tried(effect: Effect, parameter: Parameter, few: int, runs: Sequence[Run]) -> NDArray:
    values = values_in(effect, parameter, few, runs)
    least = lowest(effect, parameter, runs)
    # Multiple of the fewest waves of a ripple, up to which block averages are searched for one.
    # Faster waves are lines, known at the full sampling rate.
    slow_waves = 4.0
    most = slow_waves * least if parameter.unit in TURNS else np.inf
    return values[(values >= least) & (values <= most)]


def values_in(effect: Effect, parameter: Parameter, count: int, runs: Sequence[Run]) -> NDArray:
    """Return the values of an effect's shape to try on some runs.

    Parameters
    ----------
    effect : Effect
        Bound to its joint.
    parameter : Parameter
        One of its shapes.
    count : int
        Number of values.
    runs : sequence of Run
        The searched runs, whose angles a swept parameter follows.

    Returns
    -------
    (count,) array
        In the parameter's unit.
    """
    if effect.joint is None or not (parameter.swept or parameter.swept_end):
        return values_of(parameter, count)
    j = runs[0].motion.joint_index(effect.joint)
    # Values of unusable samples, such as glitches, are no positions.
    angles = np.concatenate([run.state[0][run.valid, j] for run in runs])
    if parameter.swept_end:
        return np.array([np.min(angles) if parameter.swept_end < 0 else np.max(angles)])
    return np.linspace(np.min(angles), np.max(angles), count + 2)[1:-1]


def values_of(parameter: Parameter, count: int) -> NDArray:
    """Return the values of a shape parameter to try.

    Parameters
    ----------
    parameter : Parameter
        A shape.
    count : int
        Greatest number of values, unless it has forms or counts cycles.

    Returns
    -------
    (n,) array
        In the parameter's unit.
    """
    if parameter.forms:
        return np.array(parameter.forms)
    if parameter.default is not None:
        return np.array([parameter.default])
    low, high = parameter.typical
    if parameter.unit in TURNS:
        # A larger step would miss the narrow maximum of a wave.
        return np.arange(low, high, parameter.grain)
    wide = low > 0.0 and high / low > 4.0
    space = np.geomspace if wide else np.linspace
    # The ends are left out: there an effect that transforms the motion does nothing or too much.
    values = space(low, high, count + 2)[1:-1]
    return values if wide else values[np.abs(values - parameter.neutral) > 0.02 * (high - low)]


def _rhythms(effect: Effect, runs: Sequence[Run], regression: DecisionRegression) -> list[float]:
    """Return the frequencies, Hz, at which a rhythm explains most, the highest peaks first."""
    low, high = effect.shape[0].typical
    tried = np.arange(low, high, TONE_STEP_HZ)
    power = np.zeros(len(tried))
    j = effect.column(runs[0].motion)
    for time, values in regression.series(j):
        if not len(time):
            continue
        # Each run has its own phase, so powers add up. The mean would leak into low frequencies.
        angle = 2.0 * np.pi * np.outer(tried, time)
        level = values - values.mean()
        power += np.abs(np.exp(1j * angle) @ level) ** 2 / len(time)
    inside = (power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])
    peaks = 1 + np.flatnonzero(inside)
    return tried[peaks[np.argsort(-power[peaks])]].tolist()


def _from_the_start(effect: Effect, runs: int) -> Candidate:
    """Return an effect with an onset, present from the start on; its instants are sought later."""
    defaults = [ALWAYS if p.per_run else p.default or 0.0 for p in effect.shape]
    return Candidate(effect, (tuple(defaults),) * runs)
