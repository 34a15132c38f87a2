"""Fit causes to some samples, and score the fit on samples that it has not seen."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns, baseline_fit
from pipelines.diagnosis.fit.held_out import halves
from pipelines.diagnosis.fit.joint_fit import fit, with_loads_of
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.fit.validation_error import errors_of


class Trial(Protocol):
    """Which samples models are fitted to, and which score them."""

    @property
    def runs(self) -> tuple[Run, ...]:
        """The runs that the reported parameters are fitted to."""

    def __call__(self, causes: Sequence[Candidate]) -> ValidationResult:
        """Fit the baseline with some causes, their shapes refined, and score it.

        Parameters
        ----------
        causes : sequence of Candidate
            None for the baseline alone.
        """

    def keeping(self, whole: ValidationResult, labels: Collection[str]) -> ValidationResult:
        """Fit some of the causes of a scored model again, at its shapes and joint loads.

        Parameters
        ----------
        whole : ValidationResult
            Of this trial.
        labels : collection of str
            Of the causes that are kept.
        """


@dataclass(frozen=True)
class HoldOut:
    """Fits to some runs, and scores on others."""

    runs: tuple[Run, ...]
    """With joint loads computed from the baseline fitted to them, as those of ``scored``."""
    scored: tuple[Run, ...]
    baseline: Baseline
    weights: np.ndarray
    """(O,) the outputs' inverse variances, 1/(N·m)²."""

    @classmethod
    def of(cls, prepared: PreparedRuns, scored: Sequence[Run]) -> "HoldOut":
        """Return fits to prepared runs.

        Parameters
        ----------
        prepared : PreparedRuns
        scored : sequence of Run
        """
        loaded = tuple(with_load(run, prepared.baseline, prepared.values) for run in scored)
        return cls(prepared.runs, loaded, prepared.baseline, prepared.weights)

    @classmethod
    def of_samples(
        cls, fitted: Sequence[Run], scored: Sequence[Run], baseline: Baseline
    ) -> "HoldOut":
        """Return fits to the usable samples of some runs.

        Parameters
        ----------
        fitted, scored : sequences of Run
        baseline : Baseline
        """
        _, weights, values = baseline_fit(fitted, baseline)
        loaded = [tuple(with_load(r, baseline, values) for r in runs) for runs in (fitted, scored)]
        return cls(loaded[0], loaded[1], baseline, weights)

    def __call__(self, causes: Sequence[Candidate]) -> ValidationResult:
        """Fit the baseline with some causes, and score it (see ``Trial``)."""
        refine = Refinement(self.runs, self.baseline, self.weights)
        return ValidationResult.of(refine(causes), self.scored, self.baseline)

    def keeping(self, whole: ValidationResult, labels: Collection[str]) -> ValidationResult:
        """Fit some causes of a scored model again (see ``Trial``)."""
        # The loads stay, so that the difference is due to the causes alone.
        runs = with_loads_of(self.runs, whole.fit, self.baseline)
        rest = [cause for cause in whole.fit.causes if cause.label in labels]
        again = fit(rest, runs, self.baseline, self.weights, whole.fit.loads)
        return ValidationResult.of(again, self.scored, self.baseline)


@dataclass(frozen=True)
class CrossValidation:
    """Fits to all runs; each half of the validation runs is scored by a fit to all but that half.

    The halves are seconds in turn. Parameters are of the fit to all runs.
    """

    train: tuple[Run, ...]
    validate: tuple[Run, ...]
    baseline: Baseline

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs."""
        return self._whole.runs

    @cached_property
    def _whole(self) -> HoldOut:
        return HoldOut.of_samples((*self.train, *self.validate), self.validate, self.baseline)

    @cached_property
    def _of_halves(self) -> tuple[HoldOut, ...]:
        """The fits that score each half."""
        return tuple(
            HoldOut.of_samples(
                (*self.train, *(_without_half(run, side) for run in self.validate)),
                self.validate,
                self.baseline,
            )
            for side in (0, 1)
        )

    def __call__(self, causes: Sequence[Candidate]) -> ValidationResult:
        """Fit the baseline with some causes, and score it (see ``Trial``)."""
        return _merged(self._whole(causes), [one(causes) for one in self._of_halves])

    def keeping(self, whole: ValidationResult, labels: Collection[str]) -> ValidationResult:
        """Fit some causes of a scored model again (see ``Trial``)."""
        parts = [
            one.keeping(part, labels)
            for one, part in zip(self._of_halves, whole.of_halves, strict=True)
        ]
        return _merged(self._whole.keeping(whole, labels), parts)


def _without_half(run: Run, side: int) -> Run:
    """Return a run of whose samples one half is not usable."""
    return replace(run, usable=run.usable & (halves(run) != side)[:, np.newaxis])


def _merged(whole: ValidationResult, of_halves: Sequence[ValidationResult]) -> ValidationResult:
    """Return the fit to all runs, with the residual of each half from the fit without it."""
    residuals = tuple(
        np.where((halves(run) == 0)[:, np.newaxis], first, second)
        for run, first, second in zip(
            whole.runs, *(one.residuals for one in of_halves), strict=True
        )
    )
    return ValidationResult(
        whole.fit, whole.runs, residuals, errors_of(whole.runs, residuals), tuple(of_halves)
    )
