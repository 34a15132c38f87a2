"""Runs that are only planned, as a detection problem."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.detectability.detectability import by_noise, usual_candidates
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import Trace, traces_of, with_background
from pipelines.diagnosis.detectability.planned_runs import planned_motions, planned_noise
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.known_effects import known_effects
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.effects import Effect
from pipelines.effects.effect import Family
from pipelines.errors import InputError
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings


@dataclass(frozen=True)
class PlannedRuns:
    """One run of each kind, with any trajectory."""

    settings: DesignSettings
    plant: PlantSettings
    """The leg that moves; it only makes the loads on which some causes depend."""
    kinds: tuple[str, ...] = ("exo_alone", "with_human")
    known: tuple[str, ...] = ()
    """Labels of effects that the machine is known to have."""
    noise_nm: tuple[float, float] | None = None
    """Noise behind the regression filter as it was measured; by default that of the settings."""
    diagnosed: tuple[Trajectory, ...] = ()
    """Motions of the runs that a diagnosis had, to which these are added."""
    diagnosed_kinds: tuple[str, ...] = ()
    background: tuple[Trace, ...] = ()
    """What even a good rig has of each cause."""

    def as_in_verdict(self, verdict: Verdict, file: Path) -> "PlannedRuns":
        """Return runs of the kinds, and with the noise, of a verdict in some file.

        Raises
        ------
        InputError
            Where it is of another machine than the leg.
        """
        noise = verdict.noise_floor_nm
        if set(noise) != {"hip", "knee"}:
            raise InputError(f"{file}: is of the joints {', '.join(noise)}, expected hip and knee")
        return replace(self, kinds=tuple(verdict.runs), noise_nm=(noise["hip"], noise["knee"]))

    def after(self, motions: Sequence[Trajectory]) -> "PlannedRuns":
        """Return runs that are added to diagnosed ones of the same kinds, with some motions."""
        return replace(self, diagnosed=tuple(motions), diagnosed_kinds=self.kinds)

    def behind_background(self, problem: DetectionProblem) -> "PlannedRuns":
        """Return runs of a rig that has a little of each cause.

        Shapes and sizes are those usual in a problem: that of the diagnosed runs, if any.
        """
        traces = traces_of(usual_candidates(by_noise(problem)), problem)
        if self.diagnosed:
            # In these runs it is the same with any further motion.
            traces = tuple(trace.known_in(problem) for trace in traces)
        return replace(self, background=traces)

    def problem(self, motion: Trajectory, effects: Sequence[Effect]) -> DetectionProblem:
        """Return the detection problem of the diagnosed runs, if any, and those with a motion.

        Where no effect depends on time, one period counts as often as it is repeated.

        Parameters
        ----------
        motion : Trajectory
            Of hip and knee.
        effects : sequence of Effect
            Those that the runs are to show.
        """
        earlier = [(one, self.diagnosed_kinds) for one in self.diagnosed]
        return self._problem([*earlier, (motion, self.kinds)], effects)

    def diagnosed_problem(self, effects: Sequence[Effect]) -> DetectionProblem:
        """Return the detection problem of the diagnosed runs alone."""
        return self._problem([(one, self.diagnosed_kinds) for one in self.diagnosed], effects)

    def _problem(
        self, planned: Sequence[tuple[Trajectory, tuple[str, ...]]], effects: Sequence[Effect]
    ) -> DetectionProblem:
        noise, rate_hz = self.settings.noise, self.settings.sample_rate_hz
        # Of further motions, too, so that runs count alike in all problems of one search.
        periods = {round(motion.period_s or 0.0, 9) for motion, _ in planned}
        periods.add(round(1.0 / self.settings.base_frequency_hz, 9))
        repeats = 1.0
        period_s = periods.pop() if len(periods) == 1 else None
        if period_s and period_s < noise.duration_s and not any(map(_depends_on_time, effects)):
            repeats = noise.duration_s / period_s
            noise = noise.model_copy(update={"duration_s": period_s})
        motions = [
            run
            for motion, kinds in planned
            for run in planned_motions(motion, self.plant, noise, kinds, rate_hz)
        ]
        observed = [observe(run) for run in motions]
        baseline = baseline_of(observed, known_effects(self.known, motions[0].machine))
        floor = planned_noise(noise, rate_hz, observed[0].block)
        rms = floor.rms if self.noise_nm is None else np.array([*self.noise_nm, np.nan, np.nan])
        floor = replace(floor, rms=rms, independent_share=repeats * floor.independent_share)
        problem = DetectionProblem.of([at_block_rate(run) for run in observed], baseline, floor)
        # One period does not show what changes over several ones.
        shown = (
            trace
            for trace in self.background
            if repeats == 1.0 or not _depends_on_time(trace.candidate.effect)
        )
        return with_background(problem, shown)


def _depends_on_time(effect: Effect) -> bool:
    """Return whether an effect's torque differs from one period of the motion to the next."""
    return effect.family is Family.TIME or any(
        shape.unit == "Hz" or shape.per_run for shape in effect.shape
    )
