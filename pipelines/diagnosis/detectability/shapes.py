"""The shapes of an effect that stand for all that it may have."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import TURNS, Candidate
from pipelines.diagnosis.candidates.shape_grid import BENDING, values_in, values_of
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import Effect, Parameter


def shapes_of(effect: Effect, runs: Sequence[Run]) -> Iterator[Candidate]:
    """Yield the effect with shapes that span its family."""
    probe = Candidate(effect, ())
    chosen = effect.directions([run.motion for run in runs])
    if chosen:
        yield from (Candidate(effect, (shape,) * len(runs)) for shape in chosen[0])
        return
    if probe.transforms_motion:
        weak = values_of(effect.shape[0], BENDING)[-1]
        yield Candidate(effect, ((float(weak),),) * len(runs))
        return
    # Parts of a run at which an effect with per-run onsets may begin.
    onsets = (0.25, 0.5, 0.75)
    grids = [onsets if p.per_run else _seen(effect, p, runs) for p in effect.shape]
    for shape in itertools.product(*grids):
        yield Candidate(effect, tuple(_in_run(effect, shape, run) for run in runs))


def _seen(effect: Effect, parameter: Parameter, runs: Sequence[Run], most: int = 6) -> NDArray:
    """Return at most so many values of a shape parameter that represent its range.

    For a ripple, those that blocks pass. Faster ones are found at the full sampling rate
    (``order_tracking``), where they are as detectable.
    """
    values = values_in(effect, parameter, most, runs)
    if parameter.unit not in TURNS or effect.joint is None:
        return _spread(values, most)
    j = runs[0].motion.joint_index(effect.joint)
    speeds = np.concatenate([run.state[1][:, j] for run in runs])
    # A ripple of n cycles a turn has n |dq| / 2 pi Hz at the speed dq.
    rms = float(np.sqrt(np.mean(speeds**2)))
    # A joint at rest shows no ripple, and then all stand for it.
    fastest = 2.0 * np.pi * runs[0].bandwidth_hz / rms if rms > 0.0 else np.inf
    return _spread(values[values <= max(fastest, values[0])], most)


def _spread(values: NDArray, most: int) -> NDArray:
    return values[np.unique(np.linspace(0, len(values) - 1, most).round().astype(int))]


def _in_run(effect: Effect, shape: Sequence[float], run: Run) -> tuple[float, ...]:
    begin, end = run.time[0], run.time[-1]
    return tuple(
        # An onset is a share of the run here; the effect needs a time.
        float(begin + v * (end - begin) if p.per_run else v)
        for p, v in zip(effect.shape, shape, strict=True)
    )
