"""Compute the evidence of a session: products of columns, and their meaning.

The decision needs nothing else.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtri

from pipelines.diagnosis.candidates.cause import Cause
from pipelines.diagnosis.candidates.library import Library, orders_of
from pipelines.diagnosis.candidates.quantisation import SearchedSteps
from pipelines.diagnosis.candidates.shape_refinement import log_searched
from pipelines.diagnosis.candidates.smooth_laws import BURSTS, HUM, QUANTISATION, TIME, LawColumn
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.effects import Family
from pipelines.wording.law import family_of_kind, law_label

LineEvidence = tuple[float, float, int]
"""A line's log likelihood ratio, its share of the torque, and its number of phases."""


@dataclass(frozen=True)
class Element:
    """A cause at one shape, or a smooth law: the element of sets."""

    label: str
    """``effect@joint``, ``law:kind@joint``; without a joint where it belongs to none alone."""
    name: str
    """The effect's name, or the law's kind."""
    joint: str | None
    family: str
    is_law: bool
    columns: list[int]
    """Places in the Gram matrix."""
    variance: list[float]
    """Relative prior variance of each coefficient; they add up to one."""
    derivative: list[int] = field(default_factory=list)
    """Places of the derivative columns along its shapes, and towards another form."""
    amplitudes: list[list[float]] = field(default_factory=list)
    """Rows: those amplitudes of the effect that are never negative, per coefficient."""
    repeats: bool = True
    """Whether it is the same in every period of the motion."""
    is_best_shape: bool = True
    """Whether it is the best shape of its cause."""
    each_run: bool = False
    """Whether its value differs from run to run."""
    sized_each_run: bool = False
    """Of a cause: whether each run has its own size of it, so that one run is no evidence of
    another's."""
    worn: bool = False
    """Whether the person carries it."""
    wearer: str = "all"
    """Of a law: in all runs' drives, or the human's share."""
    library_number: int = -1
    """Of a cause: its number in the library."""
    log_prior: float = 0.0
    """Of a cause: the part of the log odds from its shape and form; of bursts: their evidence."""
    log_searched: float = 0.0
    """The log number of values that the search for its waves, tones, onsets or steps tried."""
    lines: list[LineEvidence] = field(default_factory=list)
    """Of a ripple or a tone: its lines at the full sampling rate."""
    refined_in: int = -1
    """Of a cause: the set with whose others it was refined; -1 where it was refined alone."""

    @property
    def variant(self) -> str:
        """The label, with a suffix for a per-run cause, or for the person's."""
        if self.is_law:
            return self.label + ("" if self.wearer == "all" else f"/{self.wearer}")
        return self.label + ("/each_run" if self.each_run else "") + ("/worn" if self.worn else "")


@dataclass(frozen=True)
class Nonnegative:
    """Baseline values that are never negative, as friction and inertia; f of them."""

    alone: NDArray
    """(f,) as fitted with no cause."""
    variance: NDArray
    """(f, O) by the noise of each output."""
    imitation: NDArray
    """(f, n): values that imitate each column best, before the baseline is projected out of it."""

    @classmethod
    def of(cls, library: Library, at: "_Places", count: int) -> "Nonnegative":
        """Compute the values of the baseline from a library.

        Parameters
        ----------
        library : Library
            Causes and laws.
        at : _Places
            Columns of the library.
        count : int
            Number of all columns.
        """
        regression, known = library.regression, library.prepared.baseline.nonnegative
        # A value that no measured torque depends on has no variance.
        chosen = [k for k in known if regression.baseline[:, k].any()]
        values = regression.baseline_values(regression.torque_rows[:, np.newaxis])[:, 0]
        # An unlisted law may contain friction itself, so it imitates none.
        imitation = np.zeros((len(values), count))
        for cause, columns, derivatives in zip(
            library.causes, at.causes, at.derivatives, strict=True
        ):
            imitation[:, [*columns, *derivatives]] = cause.imitation
        return cls(values[chosen], regression.baseline_variance[chosen], imitation[chosen])


@dataclass(frozen=True)
class Evidence:
    """Products over the searched runs' rows, for each output (O,), drives first; n columns."""

    gram: NDArray
    """(O, n, n) of the columns with one another."""
    right: NDArray
    """(O, n) of the columns with the measured torque."""
    elements: tuple[Element, ...]
    background: tuple[tuple[int, float, float], ...]
    """The background of a good rig: column, its variance relative to other causes' (zero for slow
    noise), and that of noise."""
    auxiliary: Mapping[str, float]
    """Log likelihood of causes from evidence other than the mean torque, by label."""
    explained: NDArray
    """(O,) explained by all columns together of each output's rows, squared and in units of the
    noise."""
    nonnegative: Nonnegative | None = None
    contexts: tuple[tuple[int, ...], ...] = ()
    """Sets of elements whose causes were refined together."""

    @classmethod
    def of(cls, library: Library, auxiliary: Mapping[str, float]) -> "Evidence":
        """Compute the products of a library's columns."""
        X, at = _stack(library)
        regression = library.regression
        # Output by output, because each output's likelihood has a power of its own.
        outputs = [regression.output == o for o in range(len(regression.torque))]
        parts = [(X[rows], regression.measured[rows]) for rows in outputs]
        gram, right = np.array([x.T @ x for x, _ in parts]), np.array([x.T @ y for x, y in parts])
        elements = tuple(_elements(library, at))
        return cls(
            gram,
            right,
            elements,
            tuple(_background(library, at)),
            dict(auxiliary),
            np.array(list(_explained(library, at, gram, right))),
            Nonnegative.of(library, at, X.shape[1]),
            tuple(_contexts(library, elements)),
        )


def _explained(library: Library, at: "_Places", gram: NDArray, right: NDArray) -> Iterator[float]:
    """Yield the part of each output's rows that all columns explain together.

    Curves of time belong to drives.
    """
    variance = np.array([curve.noise for curve in library.curves])
    for output, (products, target) in enumerate(zip(gram, right, strict=True)):
        own = sum(curve.joint == output for curve in library.curves)
        yield explained(products, target, at.curves, variance, own)


def explained(gram: NDArray, right: NDArray, slow: NDArray, variance: NDArray, most: int) -> float:
    """Return the power of one output that columns explain beyond what noise alone would.

    Its unit is the variance of the noise. Slow noise has no form that could be wrong, but its
    variance is an estimate, so it counts at most one unit for each of its coefficients.

    Parameters
    ----------
    gram, right : (n, n) and (n,) arrays
        Products of the columns with one another and with the measured torque.
    slow : (s,) array
        Places of the curves of time, by which slow noise is described.
    variance : (s,) array
        Variance of slow noise's coefficients.
    most : int
        Number of these curves that belong to this output, and the most that slow noise counts.
    """
    # Slow noise comes first, so that only the part that the rest adds to it counts in full.
    rest = np.setdiff1d(np.arange(len(gram)), slow)
    order = np.concatenate([slow, rest]).astype(int)
    free = np.full(len(gram), 1.0 / CRITERIA.explained_share**2)
    # Least variance of slow noise's coefficients, in squared shares of the torque: keeps their
    # precision finite.
    least_variance = 1e-10
    as_noise = np.concatenate([1.0 / np.maximum(variance, least_variance), free[: len(rest)]])
    next_to_noise = _beyond_noise(gram[np.ix_(order, order)], right[order], as_noise, len(slow))
    if not most:
        return next_to_noise
    # All columns free, less the part above: the part that slow noise explains.
    of_slow_noise = max(_beyond_noise(gram, right, free, 0) - next_to_noise, 0.0)
    return next_to_noise + min(of_slow_noise, most)


def _beyond_noise(gram: NDArray, right: NDArray, precision: NDArray, first: int) -> float:
    """Return the part that columns from ``first`` on add, less the part of noise they explain.

    ``precision`` (n,) is that of the prior of each column's coefficient.
    """
    # Rows of the inverse factor from there on: the columns less their projection on those before.
    inverse = dtrtri(np.linalg.cholesky(gram + np.diag(precision)), lower=1)[0][first:]
    # The trace of S^-1 G where S = G + the precision.
    of_noise = len(inverse) - np.sum(precision[first:] * inverse[:, first:] ** 2)
    return max(float(np.sum((inverse @ right) ** 2) - of_noise), 0.0)


@dataclass(frozen=True)
class _Places:
    """Places in the matrix of columns: causes, their derivatives, laws, curves of time."""

    causes: list[NDArray]
    derivatives: list[NDArray]
    laws: NDArray
    curves: NDArray


def _stack(library: Library) -> tuple[NDArray, _Places]:
    """Stack all columns, (N, n)."""
    columns = [cause.columns for cause in library.causes]
    derivatives = [cause.derivative for cause in library.causes]
    parts = [*columns, *derivatives, library.law_columns, library.curve_columns]
    ends = np.cumsum([0, *(part.shape[1] for part in parts)])
    places = [np.arange(a, b) for a, b in pairwise(ends)]
    k = len(columns)
    return np.hstack(parts), _Places(places[:k], places[k : 2 * k], places[-2], places[-1])


def _elements(library: Library, at: _Places) -> list[Element]:
    machine = library.prepared.baseline.machine
    names = machine.names
    # A law is one element with all of its columns: none of them is missing by itself.
    laws = _laws_by_kind(library.laws, at.laws)
    for j in machine.measured_indices:
        own = [
            (int(p), c.variance)
            for p, c in zip(at.curves, library.curves, strict=True)
            if c.joint == j
        ]
        laws[TIME, j, "all"] = own
    elements = [
        _of_cause(number, cause, at, library.prepared)
        for number, cause in enumerate(library.causes)
    ]
    # Laws of the cuffs alone are no elements. They count in the explained part only.
    elements += [
        Element(
            label=law_label(kind, None if j is None else names[j]),
            name=kind,
            joint=None if j is None else names[j],
            family=family_of_kind(kind),
            is_law=True,
            columns=[int(p) for p, _ in own],
            variance=_normalised([v for _, v in own]),
            repeats=family_of_kind(kind) != Family.TIME,
            wearer=wearer,
            log_searched=float(np.log(SearchedSteps().independent))
            if kind == QUANTISATION
            else 0.0,
            lines=_lines(Kind.TIME, j, library.prepared) if kind == HUM and j is not None else [],
        )
        for (kind, j, wearer), own in laws.items()
        if wearer != "cuffs"
    ]
    elements += [
        Element(
            label=law_label(BURSTS, joint),
            name=BURSTS,
            joint=joint,
            family=family_of_kind(BURSTS),
            is_law=True,
            columns=[],
            variance=[],
            repeats=False,
            log_prior=float(ratio),
        )
        for joint, ratio in zip(names, library.prepared.bursts, strict=True)
        if machine.joint(joint).is_measured
    ]
    effects = [cause.candidate.effect for cause in library.causes]
    return _in_any_form(
        elements, {effect.label: effect.any_form for effect in effects if effect.any_form}
    )


def _in_any_form(elements: Sequence[Element], any_form: Mapping[str, str]) -> list[Element]:
    """Give laws that describe any form of a listed cause that cause's label.

    ``any_form`` has laws by label.
    """
    # Such a law stands for the cause in any form. So it needs no step along shapes, and has no
    # amplitude with a sign.
    best = {
        e.label: e for e in elements if e.label in any_form and e.is_best_shape and e.refined_in < 0
    }
    of_laws = {(any_form[label], e.joint): e for label, e in best.items()}
    return [
        replace(
            of_laws[e.name, e.joint],
            columns=e.columns,
            variance=e.variance,
            derivative=[],
            amplitudes=[],
            is_best_shape=False,
        )
        if e.is_law and e.wearer == "all" and (e.name, e.joint) in of_laws
        else e
        for e in elements
    ]


Laws = dict[tuple[str, int | None, str], list[tuple[int, float]]]


def _laws_by_kind(laws: Sequence[LawColumn], places: NDArray) -> Laws:
    laws_of: Laws = {}
    for law, place in zip(laws, places, strict=True):
        laws_of.setdefault((law.kind, law.joint, law.wearer), []).append((int(place), law.variance))
    return laws_of


def _normalised(variance: Sequence[float]) -> list[float]:
    """Return variances that add up to one: a law's squared coefficients do so, as a cause's do.

    A wandering torque and a hum have coefficients of their own in each run, and these add up too.
    """
    total = sum(variance)
    return [v / total for v in variance]


def _lines(kind: Kind, joint: int, prepared: PreparedRuns) -> list[LineEvidence]:
    """Return the evidence of a joint's lines of one kind."""
    phases = 1 if kind is Kind.ANGLE else len(prepared.runs)
    lines = prepared.lines[joint].of_kind(kind)
    # The rms of a sinusoid is its amplitude over the root of two.
    rms = np.sqrt(2.0) * float(prepared.torque[joint])
    return [(line.log_likelihood_ratio, line.amplitude / rms, phases) for line in lines]


def _of_cause(number: int, cause: Cause, at: _Places, prepared: PreparedRuns) -> Element:
    effect, names = cause.candidate.effect, prepared.baseline.joints
    joint = effect.joint
    # Only the ripple of order tracking has lines: the coarse search finds slower waves.
    tracked = (
        effect.order_tracked and joint and cause.candidate.shapes[0] == orders_of(joint, prepared)
    )
    return Element(
        label=effect.label,
        name=effect.name,
        joint=joint,
        family=str(effect.family),
        is_law=False,
        columns=at.causes[number].tolist(),
        variance=cause.variance.tolist(),
        derivative=at.derivatives[number].tolist(),
        amplitudes=cause.amplitudes[_positive(cause)].tolist(),
        repeats=not effect.depends_on_time and effect.family != Family.TIME,
        is_best_shape=cause.is_best_shape,
        each_run=effect.each_run,
        sized_each_run=effect.sized_each_run,
        worn=effect.run is not None,
        library_number=number,
        log_prior=cause.candidate.log_prior,
        log_searched=log_searched(cause.candidate),
        lines=_lines(Kind.ANGLE, names.index(joint), prepared) if tracked and joint else [],
        refined_in=cause.refined_in,
    )


def _positive(cause: Cause) -> list[int]:
    """Return which of the effect's amplitudes are never negative."""
    effect = cause.candidate.effect
    if cause.candidate.directions:
        return []
    if cause.candidate.transforms_motion:
        # A column is the effect at its shape. Reversed, it would be a spring that pushes, or a
        # negative delay.
        free = [p for p in effect.shape if p.default is None]
        # A gain, without a unit, does nothing at one, and may be on either side of it.
        return [0] if all(p.typical[0] >= 0 and p.unit != "1" for p in free) else []
    if len(effect.linear) != len(cause.amplitudes):
        return []  # some amplitude is per run
    return [i for i, p in enumerate(effect.linear) if p.typical[0] >= 0]


def _background(library: Library, at: _Places):
    """Yield the background of a good rig: column, relative variance, and variance of noise."""
    for curve, place in zip(library.curves, at.curves, strict=True):
        # Slow noise has its measured variance, not a share of the torque.
        yield int(place), 0.0, curve.noise
    for cause, places in zip(library.causes, at.causes, strict=True):
        effect = cause.candidate.effect
        # Each cause once, at its best shape: further shapes and variants would make the rig worse.
        alone = cause.is_best_shape and cause.refined_in < 0
        if alone and not effect.each_run and effect.run is None:
            yield from (
                (int(p), float(v), 0.0) for p, v in zip(places, cause.variance, strict=True)
            )


def _contexts(library: Library, elements: Sequence[Element]):
    """Yield the elements of each set whose causes were refined together."""
    laws = {element.variant: i for i, element in enumerate(elements) if element.is_law}
    for context in library.contexts:
        yield (*context.causes, *(laws[variant] for variant in context.laws))
