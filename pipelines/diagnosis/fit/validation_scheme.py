"""Choose the samples that models are fitted to, and those that score them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.prepared_runs import baseline_fit
from pipelines.diagnosis.fit.held_out import halves
from pipelines.diagnosis.fit.joint_fit import Fit, fit, with_loads_of
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.fit.validation_error import errors_of


@dataclass(frozen=True)
class HoldOut:
    """Fits to the usable samples of some runs, scored on other samples."""

    runs: tuple[Run, ...]
    """The fitted runs, with joint loads computed from the baseline fitted to them."""
    scored: tuple[Run, ...]
    """With joint loads computed from the same baseline."""
    baseline: Baseline
    weights: NDArray
    """(O,) the outputs' inverse variances, 1/(N·m)²."""

    @classmethod
    def of(cls, fitted: Sequence[Run], scored: Sequence[Run], baseline: Baseline) -> "HoldOut":
        """Fit the baseline, from which the joint loads follow.

        Parameters
        ----------
        fitted, scored : sequences of Run
        baseline : Baseline
        """
        _, weights, values = baseline_fit(fitted, baseline)
        loaded = [tuple(with_load(r, baseline, values) for r in runs) for runs in (fitted, scored)]
        return cls(loaded[0], loaded[1], baseline, weights)

    def validated(self, causes: Sequence[Candidate]) -> ValidationResult:
        """Fit the baseline with some causes, their shapes refined, and score it."""
        # After a search of all runs, causes have shapes in further runs too.
        own = [replace(cause, shapes=cause.shapes[: len(self.runs)]) for cause in causes]
        return self._scored(Refinement(self.runs, self.baseline, self.weights)(own))

    def refitted(self, result: ValidationResult, kept: Collection[str]) -> ValidationResult:
        """Fit some causes of a result again, at its shapes and joint loads, and score them."""
        return self.refitted_from(result.fit, kept)

    def refitted_from(self, whole: Fit, kept: Collection[str]) -> ValidationResult:
        """Fit some causes of a fit to these runs again, and score them."""
        # The loads stay, so that the difference is due to the causes alone.
        runs = with_loads_of(self.runs, whole, self.baseline)
        rest = [cause for cause in whole.causes if cause.label in kept]
        return self._scored(fit(rest, runs, self.baseline, self.weights, whole.loads))

    def _scored(self, fitted: Fit) -> ValidationResult:
        return ValidationResult.of(fitted, self.scored, self.baseline)


@dataclass(frozen=True)
class CrossValidation:
    """Fits to all runs; each half of the validation runs is predicted by a fit to all other data.

    A half has every other second, in an order without a rhythm. Parameters are of the fit to all
    runs.
    """

    train: tuple[Run, ...]
    validate: tuple[Run, ...]
    baseline: Baseline

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs."""
        return self._all_runs.runs

    @cached_property
    def _all_runs(self) -> HoldOut:
        return HoldOut.of((*self.train, *self.validate), self.validate, self.baseline)

    @cached_property
    def _without_half(self) -> tuple[HoldOut, ...]:
        """The schemes whose fits do not see the first, and the second half."""
        return tuple(
            HoldOut.of(
                (*self.train, *(_hiding(run, half) for run in self.validate)),
                self.validate,
                self.baseline,
            )
            for half in (0, 1)
        )

    def validated(self, causes: Sequence[Candidate]) -> ValidationResult:
        """Fit the baseline with some causes, their shapes refined, and score it."""
        return _merged(
            self._all_runs.validated(causes), [one.validated(causes) for one in self._without_half]
        )

    def refitted(self, result: ValidationResult, kept: Collection[str]) -> ValidationResult:
        """Fit some causes of a result again, at its shapes and joint loads, and score them."""
        parts = [
            one.refitted_from(half_fit, kept)
            for one, half_fit in zip(self._without_half, result.half_fits, strict=True)
        ]
        return _merged(self._all_runs.refitted(result, kept), parts)


ValidationScheme = HoldOut | CrossValidation
"""How models are fitted and scored. Reported parameters are fitted to its ``runs``."""


def _hiding(run: Run, half: int) -> Run:
    """Return a run in which one half of the samples is not usable."""
    return replace(run, usable=run.usable & (halves(run) != half)[:, np.newaxis])


def _merged(
    of_all_runs: ValidationResult, without_half: Sequence[ValidationResult]
) -> ValidationResult:
    """Return the fit to all runs, with the residual of each half from the fit without it."""
    residuals = tuple(
        np.where((halves(run) == 0)[:, np.newaxis], first, second)
        for run, first, second in zip(
            of_all_runs.runs, *(one.residuals for one in without_half), strict=True
        )
    )
    return replace(
        of_all_runs,
        residuals=residuals,
        errors=errors_of(of_all_runs.runs, residuals),
        half_fits=tuple(one.fit for one in without_half),
        without_steps=of_all_runs.residuals,
    )
