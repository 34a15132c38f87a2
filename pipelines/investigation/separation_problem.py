"""Rivals with their sizes, the runs to plan, and what runs have shown already."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival, effects_of
from pipelines.investigation.separation import Separation
from pipelines.investigation.sized_rival import SizedRival, sized
from pipelines.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class SeparationProblem:
    """The question how well further runs with a motion would separate some rivals."""

    rivals: tuple[SizedRival, ...]
    runs: PlannedRuns
    earlier: Separation | None
    """Of the diagnosed runs; None where there are none."""

    @classmethod
    def of(
        cls, rivals: Sequence[Rival], runs: PlannedRuns, last: Trajectory
    ) -> "SeparationProblem":
        """Size the rivals by the diagnosed runs, or else by runs with the last excitation.

        Raises
        ------
        InputError
            Where such runs cannot show a rival.
        """
        effects = effects_of(rivals)
        if not runs.background:
            runs = runs.behind_background(
                runs.diagnosed_problem(effects) if runs.diagnosed else runs.problem(last, effects)
            )
        bounds = runs.settings.bounds
        if not runs.diagnosed:
            return cls(tuple(sized(rivals, runs.problem(last, effects), bounds)), runs, None)
        problem = runs.diagnosed_problem(effects)
        own = tuple(sized(rivals, problem, bounds))
        return cls(own, runs, Separation.of(own, problem, diagnosed=len(problem.runs)))

    def with_motion(self, motion: Trajectory, kinds: tuple[str, ...] | None = None) -> Separation:
        """Return how well further runs with a motion separate the rivals, of each kind or some."""
        runs = replace(self.runs, kinds=kinds) if kinds else self.runs
        problem = runs.problem(motion, effects_of([one.rival for one in self.rivals]))
        diagnosed = len(runs.diagnosed) * len(runs.diagnosed_kinds)
        return Separation.of(self.rivals, problem, self.earlier, diagnosed)
