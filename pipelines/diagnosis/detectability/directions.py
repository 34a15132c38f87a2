"""The columns in which an effect shows, and all that its amplitudes can explain."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import Effect
from pipelines.model import TermColumns


def parts_of(candidate: Candidate, problem: DetectionProblem) -> list[NDArray]:
    """Return the torque of each amplitude of a candidate, (m, O, k) of each run.

    One that transforms the motion has one part, at the size of its shape. Runs have equal shapes.
    """
    candidate = Candidate(candidate.effect, (candidate.shapes[0],) * len(problem.runs))
    if candidate.transforms_motion:
        return bend(candidate, problem)
    return [torque_columns(candidate, r, run) for r, run in enumerate(problem.runs)]


def unit_torque(
    candidate: Candidate, parts: list[NDArray], problem: DetectionProblem
) -> list[NDArray]:
    """Return the torque at a first amplitude of 1, (m, O, 1) of each run, from its parts."""
    if candidate.transforms_motion:
        return parts
    return direction_of(candidate.effect, parts, problem)


class Trace(NamedTuple):
    """A little of a cause, as a good rig has it."""

    candidate: Candidate
    linear: NDArray
    """(k,) one standard deviation of its amplitudes, which go together; of one that transforms the
    motion, of the torque over that at the shape."""
    known: tuple[NDArray, ...] = ()
    """(m, O, 1) its torque in the first runs of a problem, where it was computed before."""

    def torque(self, problem: DetectionProblem) -> list[NDArray]:
        """Return its torque, (m, O, 1) of each run."""
        first = len(self.known)
        others = replace(problem, runs=problem.runs[first:], untouched=problem.untouched[first:])
        parts = parts_of(self.candidate, others)
        return [*self.known, *(part @ self.linear[:, np.newaxis] for part in parts)]

    def known_in(self, problem: DetectionProblem) -> "Trace":
        """Return it with its torque in a problem's runs, which may be the first ones of others."""
        return self._replace(known=tuple(self.torque(problem)))


def traces_of(candidates: Iterable[Candidate], problem: DetectionProblem) -> tuple[Trace, ...]:
    """Return what a good rig has of some candidates: shares of its torque in a problem's runs."""
    traces = []
    for candidate in candidates:
        effect, parts = candidate.effect, parts_of(candidate, problem)
        unit = unit_torque(candidate, parts, problem)
        rms = problem.rms(effect, unit)
        # Of one that makes no torque in these runs no share is known.
        if rms > 0.0:
            share = CRITERIA.background_cause * float(problem.torque_rms[problem.joint(effect)])
            A, y = (
                np.concatenate([c[run.usable] for run, c in zip(problem.runs, of, strict=True)])
                for of in (parts, unit)
            )
            traces.append(Trace(candidate, share / rms * np.linalg.lstsq(A, y[:, 0])[0]))
    return tuple(traces)


def with_background(problem: DetectionProblem, traces: Iterable[Trace]) -> DetectionProblem:
    """Return a problem with the background of a good rig."""
    columns = [problem.remainder(trace.torque(problem))[:, 0] for trace in traces]
    return replace(problem, background=np.array(columns).T) if columns else problem


def direction_of(
    effect: Effect, columns: Sequence[NDArray], problem: DetectionProblem
) -> list[NDArray]:
    """Return the effect at unit magnitude, (m, O, 1) of each run.

    Companions of either sign (a preload, a level, the cosine of a sine) are chosen to minimise its
    torque: a spring rests in the middle of the motion, a drift starts at minus half of its end.
    """
    lead = [c[:, :, :1] for c in columns]
    companions = _companions(effect)
    if not companions:
        return lead
    others = chosen_columns(effect, columns, companions, problem.runs)
    usable = [run.usable for run in problem.runs]
    A, y = (
        np.concatenate([c[u] for c, u in zip(part, usable, strict=True)]) for part in (others, lead)
    )
    values = np.linalg.lstsq(A, y[:, 0], rcond=1e-12)[0]
    return [c - (w @ values)[:, :, np.newaxis] for c, w in zip(lead, others, strict=True)]


def _companions(effect: Effect) -> list[int]:
    """Return the amplitudes that may have either sign and only accompany the first one."""
    # One that is zero by default refines the form, and no effect needs it to show.
    refines = [p.default is not None for p in effect.linear]
    return [i for i, p in enumerate(effect.linear) if i and p.typical[0] < 0 and not refines[i]]


def levels(effect: Effect) -> list[int]:
    """Return those companions that differ in unit from the first amplitude.

    A preload accompanies a stiffness, for example.
    """
    return [i for i in _companions(effect) if effect.linear[i].unit != effect.linear[0].unit]


def chosen_columns(
    effect: Effect, columns: Sequence[NDArray], chosen: list[int], runs: Sequence[Run]
) -> list[NDArray]:
    """Return some of an effect's columns, per-run ones in places of their own, (m, O, k)."""
    per_run = [effect.linear[i].per_run for i in chosen]
    own = TermColumns.of(effect, [run.motion.run for run in runs], per_run)
    return [own.expand(column[:, :, chosen], r) for r, column in enumerate(columns)]


def bend(candidate: Candidate, problem: DetectionProblem) -> list[NDArray]:
    """Return the change from the untouched to the transformed baseline, (m, O, 1) of each run.

    The effect is not linear, so the baseline is computed again from the transformed motion.
    Linearised at biased parameters, elasticity would be mistaken for an encoder offset.
    """
    changes = []
    for r, (run, untouched) in enumerate(zip(problem.runs, problem.untouched, strict=True)):
        columns, measured = columns_under([candidate.term(r)], run, problem.baseline)
        plain = untouched @ problem.values
        change = columns @ problem.values - plain - (measured - run.measured)
        changes.append(change[:, :, np.newaxis])
    return changes


def orthonormal(columns: NDArray) -> NDArray:
    """Return an orthonormal basis of the columns that are not zero, (rows, k)."""
    size = np.linalg.norm(columns, axis=0)
    if not size.any():
        return columns[:, :0]
    scaled = columns / np.where(size > 0, size, 1.0)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-8 * s[0]]


def unit_vector(x: NDArray) -> NDArray:
    """Return a vector (n,) at unit length; one of zeros as it is."""
    length = np.sqrt(squared(x))
    return x / length if length > 0 else x


def squared(x: NDArray) -> float:
    """Return the sum of the squares of all elements, (n,) or more."""
    return float(np.sum(x * x))
