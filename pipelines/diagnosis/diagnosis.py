"""The result of a diagnosis, from which the verdict is written."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.detection_lines import (
    JointDetectionLines,
    LineSpectrum,
    detection_lines,
    line_spectrum,
)
from pipelines.diagnosis.evidence.model_error import imperfection
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit import parameter_rows
from pipelines.diagnosis.fit.fitted_model import values_of_each_run
from pipelines.diagnosis.fit.joint_fit import residuals_on
from pipelines.diagnosis.fit.presliding_test import BuildUp, built_up
from pipelines.diagnosis.fit.simulation_error import simulation_error
from pipelines.diagnosis.fit.uncertainty import Uncertainty, uncertainty
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.fit.validation_error import Gain, errors_of, gain
from pipelines.diagnosis.fit.validation_scheme import ValidationScheme
from pipelines.diagnosis.judged_fit import JudgedFit
from pipelines.diagnosis.selection.answer import NamedCause
from pipelines.diagnosis.selection.selection import Selection
from pipelines.diagnosis.training_data import TrainingData
from pipelines.effects import Effect
from pipelines.effects.baseline import ForceSensorZero
from pipelines.estimation.collinearity import collinearities, profiled
from pipelines.model import Column, complete_bodies, unrealizable, upside_down


@dataclass(frozen=True)
class Diagnosis:
    """A session, its named causes, and the model with them."""

    data: TrainingData
    noise: NoiseModel
    """Of the training runs."""
    scheme: ValidationScheme
    """Which samples the models are fitted to, and which score them."""
    selected: Selection
    before: ValidationResult
    """The baseline."""
    after: ValidationResult
    """The baseline with the named causes."""
    without: dict[str, ValidationResult]
    """The named causes less one, by that cause's label."""
    floor: Floor
    """Of the validation runs."""
    uncertainty: Uncertainty
    parameters: pd.DataFrame
    covariance: NDArray
    residuals: pd.DataFrame
    reversals: tuple[BuildUp, ...]
    """Joints whose friction builds up over a travel where they reverse, where no fit has
    samples."""
    simulation_error: dict[str, NDArray | None]
    """(J,) rad of 1 s simulations with the baseline and with the extended model."""

    @classmethod
    def of(cls, data: TrainingData, noise: NoiseModel, judged: JudgedFit) -> "Diagnosis":
        """Compute intervals, parameters, simulation errors and reversals.

        Parameters
        ----------
        data : TrainingData
        noise : NoiseModel
            Of the training runs.
        judged : JudgedFit
            The named causes, fitted and judged.
        """
        baseline, before, after = data.baseline, judged.before, judged.after
        fitted, validate = judged.scheme.runs, before.runs
        imperfect = imperfection(fitted, baseline, before.fit.values)
        known = uncertainty(after.fit, fitted, baseline, imperfect)
        parameters, covariance = parameter_rows.parameters(after.fit, baseline, known)
        drift = simulation_error(before.fit, validate, baseline)
        # Without named causes both models are the same.
        after_drift = drift if after is before else simulation_error(after.fit, validate, baseline)
        residuals = {"baseline": before.residuals, "extended": after.residuals}
        train = fitted[: len(data.train)]
        reversals = [] if data.spoilt else built_up(after.fit, baseline, train, validate)
        return cls(
            data,
            noise,
            judged.scheme,
            judged.selected,
            before,
            after,
            judged.without,
            after.floor,
            known,
            parameters,
            covariance,
            parameter_rows.residual_table(validate, residuals),
            tuple(reversals),
            {"baseline": drift, "extended": after_drift},
        )

    @property
    def baseline(self) -> Baseline:
        """The model without causes."""
        return self.data.baseline

    @property
    def fitted_runs(self) -> tuple[Run, ...]:
        """The runs that the models are fitted to, with joint loads computed from the baseline."""
        return self.scheme.runs

    @property
    def fitted_to_all(self) -> bool:
        """Whether the models are fitted to the validation runs too, and cross-validated."""
        return len(self.fitted_runs) > len(self.data.train)

    @property
    def training_runs(self) -> tuple[Run, ...]:
        """Those of the fitted runs that no model is scored on."""
        return self.fitted_runs[: len(self.data.train)]

    @property
    def sought_on_all(self) -> bool:
        """Whether causes were sought on all runs."""
        return self.selected.training_alone is not None

    @property
    def validate(self) -> tuple[Run, ...]:
        """The validation runs."""
        return tuple(self.before.runs)

    @property
    def named(self) -> tuple[NamedCause, ...]:
        """The named causes, the most probable first."""
        return self.selected.answer.named

    @property
    def causes(self) -> tuple[str, ...]:
        """Labels of the named causes."""
        return self.selected.answer.labels

    @property
    def status(self) -> str:
        """The verdict's status."""
        if self.data.spoilt:
            return "unknown_cause"
        if not self.named:
            return "unknown_cause" if self.selected.shows_something else "nothing_missing"
        # A finding that ends above a cause says that more is missing than what is named.
        more = any(one.level != "cause" for one in self.selected.findings)
        more |= self.selected.shows_unlisted
        return "partly_explained" if more or any(self.left_over) else "explained"

    @property
    def floor_rms(self) -> NDArray:
        """(J,) N·m noise floor of the drives; infinite where the torque was not measured."""
        measured = self.baseline.machine.measured
        return np.where(measured, self.floor.rms[: len(measured)], np.inf)

    @property
    def unexplained(self) -> list[float | None]:
        """Share of each joint's systematic power that remains; None where there was none."""
        floor = self.floor_rms**2
        before, after = self.before.errors.rms**2, self.after.errors.rms**2
        remaining = np.maximum(after - floor, 0.0)
        was = self.before.above(self.floor)
        # A joint that was at the floor has no systematic power; its quotient is discarded below.
        shares = remaining / np.where(was, before - floor, 1.0)
        return [float(share) if there else None for share, there in zip(shares, was, strict=True)]

    @property
    def left_over(self) -> list[bool]:
        """Whether each joint ends above the floor, with a large part of its systematic power.

        The part is more than ``left_of_explained``.
        """
        shares = zip(self.unexplained, self.after.above(self.floor), strict=True)
        return [
            bool(above) and share is not None and share > CRITERIA.left_of_explained
            for share, above in shares
        ]

    @property
    def has_periods(self) -> bool:
        """Whether some recording names the period of its motion."""
        return any(run.motion.period_s for run in (*self.fitted_runs, *self.validate))

    @property
    def is_mostly_unexplained(self) -> bool:
        """Whether most of some joint's mean square error remains and is above the noise floor."""
        # From twice the floor's power on, the systematic part exceeds the noise.
        return bool(np.any(self.after.errors.rms**2 > 2.0 * self.floor_rms**2))

    @property
    def leaves_something(self) -> bool:
        """Whether the extended model leaves more than noise at some joint."""
        if self.data.spoilt:
            return False
        if self.status == "nothing_missing":
            return self.is_mostly_unexplained
        return self.status != "explained" or self.after.leaves_more_than_noise

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """The fitted effects of the named causes, by label."""
        return {cause.label: cause.effect for cause in self.after.fit.causes}

    def effect_of(self, label: str) -> Effect:
        """Return the effect of a label in the library, at its most probable shape."""
        assert self.selected.library is not None and self.selected.posterior is not None
        # Sets are in the order of their probability, so
        # the first with the label has the best shape.
        sets = (i for chosen in self.selected.posterior.sets for i in chosen)
        elements = self.selected.posterior.elements
        place = next(elements[i].library_number for i in sets if elements[i].label == label)
        return self.selected.library.causes[place].candidate.effect

    @cached_property
    def each_run(self) -> dict[str, list[dict[str, Any]]]:
        """The per-run values of the named causes, by label."""
        others = () if self.fitted_to_all else self.validate
        return values_of_each_run(
            self.after.fit, self.baseline, self.uncertainty, self.fitted_runs, others
        )

    @cached_property
    def gains(self) -> dict[str, Gain]:
        """The gain of each named cause on the validation runs, the others kept, by label."""
        after = self.after.errors
        return {label: gain(less.errors, after) for label, less in self.without.items()}

    @cached_property
    def detection_lines(self) -> dict[str, JointDetectionLines]:
        """What detection lines show at each joint; empty for motions without them."""
        runs = (*self.fitted_runs, *self.validate)
        # Other recordings need no residuals of all runs.
        if self.data.spoilt or not any(run.motion.metadata.get("excited_lines") for run in runs):
            return {}
        joints = zip(self.baseline.joints, detection_lines(*self._all_residuals), strict=True)
        return {joint: lines for joint, lines in joints if lines is not None}

    def line_spectrum(self, joint: str) -> LineSpectrum | None:
        """Return the spectrum of a joint's torque; None for motions without detection lines."""
        runs, residuals, _ = self._all_residuals
        return line_spectrum(runs, residuals, self.baseline.joints.index(joint))

    @cached_property
    def _all_residuals(self) -> tuple[list[Run], list[NDArray], list[NDArray] | None]:
        """Return the fitted and the validation runs, with both models' residuals (m, O) N·m.

        The latter is None without causes.
        """
        runs, others = list(self.fitted_runs), () if self.fitted_to_all else self.validate

        def residuals(result: ValidationResult) -> list[NDArray]:
            scored = () if self.fitted_to_all else result.residuals
            return [*residuals_on(result.fit, runs, self.baseline), *scored]

        extended = residuals(self.after) if self.named else None
        return [*runs, *others], residuals(self.before), extended

    @cached_property
    def torque_rms(self) -> NDArray:
        """(J,) N·m rms of the measured torque, on the samples that errors are counted on."""
        return errors_of(self.validate, [run.measured for run in self.validate]).rms

    @property
    def collinear(self) -> list[str]:
        """Nearly collinear parameters of the extended model on the fitted runs, in words."""
        fit = self.after.fit
        shapes = [(fit.causes[k].effect, i) for k, i, _ in self.uncertainty.shapes]
        own = (Column(effect, effect.shape[i], None) for effect, i in shapes)
        columns = [*fit.layout.columns, *own]
        # The zeros of the force sensors are no result: they are projected out.
        zeros = [isinstance(column.effect, ForceSensorZero) for column in columns]
        names = [c.name for c, zero in zip(columns, zeros, strict=True) if not zero]
        normal = profiled(self.uncertainty.normal, np.flatnonzero(zeros))
        # A column that is zero in all runs has no direction.
        seen = np.flatnonzero(np.diag(normal) > 0.0)
        return collinearities(normal[np.ix_(seen, seen)], [names[place] for place in seen])

    @property
    def unrealizable(self) -> list[str]:
        """Reasons why no real machine has the extended model's rigid bodies; empty if one may."""
        geometry = self.fitted_runs[0].motion.geometry
        return unrealizable(self.parameters, self.baseline.machine, geometry)

    @cached_property
    def lacks_mass(self) -> bool:
        """Whether a rigid body's least inertia is negative by more than its standard error."""
        table = self.parameters.reset_index(drop=True)
        geometry = self.fitted_runs[0].motion.geometry
        for rows in complete_bodies(table, self.baseline.machine).values():
            own = rows.index.to_numpy()
            # Delta method: ``slope`` carries the parameters' covariance to the least inertia.
            least, _, slope = self.baseline.machine.mechanism.least_inertia(rows["value"], geometry)
            if least < -np.sqrt(slope @ self.covariance[np.ix_(own, own)] @ slope):
                return True
        return False

    @property
    def upside_down(self) -> list[str]:
        """Links that the extended model has upside down; empty if none."""
        return upside_down(self.parameters, self.baseline.machine)
