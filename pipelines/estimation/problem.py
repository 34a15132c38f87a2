"""An estimation problem: columns of a model, fitted to the training runs of some kinds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.compressed import CompressedRows, compress, together
from pipelines.estimation.regression import Regression, regressions
from pipelines.estimation.undetermined import undetermined
from pipelines.mechanics.constant_torque import constant_torque
from pipelines.mechanics.run import Run, kinds_of
from pipelines.model import Model, ParameterLayout, Term


@dataclass(frozen=True)
class Training:
    """The runs that a model is fitted to."""

    runs: tuple[Run, ...]
    model: Model
    """Model of all kinds of run; a term that does not act in a run has columns of zeros there."""
    own: Mapping[str, tuple[Term | None, ...]] = field(default_factory=dict)
    """By a run's file, the model's terms in that run, such as another zero or onset; None for a
    term that is absent."""
    bodies: Mapping[str, tuple[NDArray, NDArray]] = field(default_factory=dict)
    """By the kind of run, parameters of the rigid bodies from which loads are computed: the body
    behind the drive trains, and the limb."""
    reversals: bool = False
    """Whether samples near reversals are fitted too."""
    cutoff_hz: float | None = None
    """Frequency above which nothing is fitted; None for no limit."""
    about: NDArray | None = None
    """(p,) values about which the equations of passive joints are made independent of the scale of
    all parameters; None: they are fitted as they are."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of run that occur, exo_alone first."""
        return kinds_of(self.runs)

    @cached_property
    def layout(self) -> ParameterLayout:
        """Layout of the p linear parameters, with a column per run for those that differ by run."""
        absent = [
            (term, number)
            for number, run in enumerate(self.runs)
            for term, own in enumerate(self._terms_of(run))
            if own is None
        ]
        effects = [term.effect for term in self.model]
        return ParameterLayout.of(effects, [run.run for run in self.runs], absent)

    @cached_property
    def undetermined(self) -> NDArray:
        """(p,) bool: columns that are zero wherever a torque is known; they are not fitted."""
        return undetermined(self.layout, self.runs)

    def _terms_of(self, run: Run) -> tuple[Term | None, ...]:
        """Return the model's terms in a run; None for a term that is absent."""
        return self.own.get(run.file, self.model.terms)

    def _number_of(self, run: Run) -> int | None:
        """Return the number of a training run by its file; None if it is no training run."""
        return next(
            (number for number, other in enumerate(self.runs) if other.file == run.file), None
        )

    def model_of(self, run: Run, values: NDArray) -> Model:
        """Return the model of one run.

        Parameters
        ----------
        run : Run
            A training run, or another one.
        values : (p,) array
            Values of all columns, in their parameters' units.

        Returns
        -------
        Model
            Without the terms that are absent in the run.
        """
        terms = (self.term_of(run, i, values) for i in range(len(self.model.terms)))
        return Model(tuple(term for term in terms if term is not None))

    def term_of(self, run: Run, term: int, values: NDArray) -> Term | None:
        """Return a term in a run.

        Parameters
        ----------
        run : Run
            A training run, or another one.
        term : int
            Number of the term in the model.
        values : (p,) array
            Values of all columns, in their parameters' units.

        Returns
        -------
        Term or None
            None if the term is absent in the run.
        """
        # A per-run shape, such as an onset, is the run's own; amplitudes come from the columns.
        own = self._terms_of(run)[term]
        if own is None:
            return None
        linear = self.layout.terms[term].select(values, self._number_of(run), own.linear)
        return Term(own.effect, np.append(linear, own.shape))

    def reshaped(self, term: int, shape: int, step: float, files: Sequence[str]) -> "Training":
        """Return the same training with another shape value of a term in some runs.

        Parameters
        ----------
        term, shape : int
            Numbers of the term, and of its shape parameter.
        step : float
            Added to the shape value, in its unit.
        files : sequence of str
            Files of the runs that change.
        """
        own = {run.file: list(self._terms_of(run)) for run in self.runs}
        for file in files:
            before = own[file][term]
            if before is not None:
                own[file][term] = before.with_shape(shape, before.shape[shape] + step)
        return replace(self, own={file: tuple(terms) for file, terms in own.items()})

    def loaded(self, run: Run) -> Run:
        """Return a run with its joint loads; unchanged if the bodies of its kind are unknown."""
        bodies = self.bodies.get(run.run)
        return run if bodies is None else run.whole().loaded(*bodies)

    def with_bodies(self, bodies: Mapping[str, tuple[NDArray, NDArray]]) -> "Training":
        """Return the same training with the loads of other rigid bodies.

        Parameters
        ----------
        bodies : mapping
            By kind of run: two arrays (k,) of body values, as ``Motion.loaded`` takes them.
        """
        training = replace(self, bodies=bodies)
        # Two steps, because ``loaded`` reads the bodies that were set.
        return replace(training, runs=tuple(training.loaded(run) for run in self.runs))

    def regressions(self, run: Run) -> Iterator[Regression]:
        """Yield a run's regression on the p columns, piece by piece.

        Parameters
        ----------
        run : Run
            A training run, or another one.

        Yields
        ------
        Regression
            Regressor (m, J, p), N·m per unit. Samples near reversals are usable if ``reversals`` is
            set.
        """
        number = self._number_of(run)
        present = [i for i, term in enumerate(self._terms_of(run)) if term is not None]
        # Columns do not depend on the amplitudes, so these are zero.
        model = self.model_of(run, np.zeros(self.layout.size))
        for r in regressions(run, model, self.cutoff_hz):
            # A per-run parameter has a column for each run, with zeros in the rows of all others.
            r = replace(r, regressor=self.layout.expand(r.regressor, number, present))
            if self.reversals:
                # A sample is valid at all joints or none; only reversals are each joint's own.
                r = replace(r, usable=r.valid[:, np.newaxis] & r.measured)
            yield self._free_of_scale(r, run)

    def _free_of_scale(self, r: Regression, run: Run) -> Regression:
        """Return the regression with the equation of each passive joint over its inertia.

        The torque of a passive joint is exactly zero, and its acceleration is uncertain. So the
        residual ``A x`` counts relative to the joint's inertia ``d x``, linearized about known
        values. As it is, noise would favour values that are all too small.
        """
        if self.about is None:
            return r
        regressor, torque = r.regressor.copy(), r.torque.copy()
        for j, inertia in self._inertias(run).items():
            residual = torque[:, j] - regressor[:, j] @ self.about
            regressor[:, j] += np.outer(residual, inertia / (inertia @ self.about))
            torque[:, j] = residual
        return replace(r, regressor=regressor, torque=torque)

    def _inertias(self, run: Run) -> dict[int, NDArray]:
        """Return the mean inertia at each passive joint of a run, per unit of the p columns."""
        level, mechanism = replace(run.geometry, gravity_m_s2=0.0), run.machine.mechanism
        inertias = {}
        for j, joint in enumerate(run.machine.joints):
            if not joint.is_passive:
                continue
            inertias[j] = np.zeros(self.layout.size)
            for piece in run.pieces(0):
                q = piece.motion.q[piece.core][piece.motion.valid[piece.core]]
                still = np.zeros_like(q)
                unit = still + np.eye(q.shape[1])[j]
                own, rest = (mechanism.regressor(q, still, a, level)[:, j] for a in (unit, still))
                for body in self.layout.bodies_in(run.run):
                    inertias[j][body] += (own - rest).sum(axis=0)
        return inertias

    @cached_property
    def compressed(self) -> tuple[CompressedRows, ...]:
        """Rows of each run on all columns, computed once for every fit.

        Raises
        ------
        InputError
            If the torque of a joint is zero in all of them.
        """
        parts = tuple(compress(self.regressions(run)) for run in self.runs)
        # Compressed rows show a torque of zero, but not a constant one: that needs the samples.
        for j, joint in enumerate(self.runs[0].machine.joints if self.runs else ()):
            is_zero = all(part.count[j] > 0 and not part.torque[j].any() for part in parts)
            if is_zero and not joint.is_passive:
                raise constant_torque(self.runs, joint, 0.0)
        return parts

    @cached_property
    def whole(self) -> "Training":
        """The same with whole runs in memory."""
        return replace(self, runs=tuple(run.whole() for run in self.runs))


@dataclass(frozen=True)
class Problem:
    """``torque = regressor @ parameters + noise`` in p parameters, some fitted, others held."""

    training: Training
    kinds: tuple[str, ...]
    """Kinds of run that are fitted."""
    fitted: NDArray
    """(k,) columns that are fitted."""
    held: NDArray
    """(p,) values of the columns that are held; the entries of fitted columns are ignored."""

    @property
    def names(self) -> list[str]:
        """Names of the fitted parameters in messages."""
        # A per-run parameter has a column for each run, so its name needs the run's file.
        runs, columns = self.training.runs, self.training.layout.columns
        return [
            column.name if column.run is None else f"{column.name} of {runs[column.run].file}"
            for column in (columns[place] for place in self.fitted)
        ]

    @property
    def runs(self) -> list[tuple[int, Run]]:
        """Number and run of the runs that are fitted."""
        return [
            (number, run) for number, run in enumerate(self.training.runs) if run.run in self.kinds
        ]

    @property
    def rows(self) -> CompressedRows:
        """All usable rows of these runs on all columns, compressed."""
        return together([self.training.compressed[number] for number, _ in self.runs])

    @property
    def of_held(self) -> NDArray:
        """Columns that are held, (p - k,)."""
        return np.setdiff1d(np.arange(len(self.held)), self.fitted)

    def regressions(self) -> Iterator[tuple[int, Regression]]:
        """Yield the regression of each run on all p columns, piece by piece.

        Yields
        ------
        tuple
            Number of the run, and a Regression whose regressor is (m, J, p), N·m per unit.
        """
        for number, run in self.runs:
            for regression in self.training.regressions(run):
                yield number, regression

    def whole(self) -> "Problem":
        """Return the same problem with whole runs in memory, for methods that simulate them."""
        return replace(self, training=self.training.whole)

    def completed(self, values: NDArray) -> NDArray:
        """Return the values of all columns.

        Parameters
        ----------
        values : (k,) array
            Values of the fitted columns.

        Returns
        -------
        (p,) array
            With the held values in the other places.
        """
        every = self.held.copy()
        every[self.fitted] = values
        return every
