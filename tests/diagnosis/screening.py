"""A session's training runs as the decision sees them, for tests of single candidates."""

from collections.abc import Sequence
from dataclasses import dataclass

from pipelines.diagnosis.candidates.candidate_rows import CandidateRows
from pipelines.diagnosis.candidates.shape_grid import screened
from pipelines.diagnosis.candidates.shape_refinement import CandidateFit, ShapeRefinement
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns, prepare
from pipelines.effects import Effect
from pipelines.mechanics.motion import Motion


@dataclass(frozen=True)
class Screening:
    """What single candidates are fitted in."""

    prepared: PreparedRuns
    regression: DecisionRegression
    rows: CandidateRows
    alone: ShapeRefinement

    @classmethod
    def of(cls, motions: Sequence[Motion]) -> "Screening":
        """Set up the regression of the motions that are to train on."""
        return cls.of_runs([observe(motion) for motion in motions if motion.purpose == "train"])

    @classmethod
    def of_runs(cls, runs: Sequence[Run]) -> "Screening":
        """Set up the regression of some runs, as ``build_library`` does."""
        prepared = prepare(runs, baseline_of(runs))
        misfit = CRITERIA.form_misfit * prepared.slow_rms
        regression = DecisionRegression.of(
            prepared.runs, prepared.columns, prepared.noise, prepared.torque, misfit
        )
        rows = CandidateRows(prepared.runs, prepared.baseline, regression)
        return cls(prepared, regression, rows, ShapeRefinement(rows, regression))

    def fits(self, effect: Effect) -> list[CandidateFit]:
        """Return the fits of an effect's coarse search, the best first."""
        return screened(effect, self.alone, self.prepared.runs, self.regression)

    def refined(self, start: CandidateFit) -> tuple[float, ...]:
        """Return the shape that the refinement finds from a start."""
        return self.alone.refined(start)[0].candidate.shapes[0]
