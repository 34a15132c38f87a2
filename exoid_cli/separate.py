"""What ``exoid design --separate`` and ``exoid next`` share: rival causes, and what they show."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console
from exoid_cli.excitation import (
    criterion_text,
    excitations,
    planned_geometry,
    show_quality,
    warn_of_cut,
    write_excitation,
)

if TYPE_CHECKING:
    from pipelines.investigation.separation import Separation
    from pipelines.investigation.separation_problem import SeparationProblem
    from pipelines.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class Question:
    """The question which experiment decides between some rivals."""

    problem: "SeparationProblem"
    last: "Trajectory"
    """The excitation that was followed last, or else is to be followed."""
    name: str
    """Of that one."""


def question_of(
    labels: Sequence[str], folder: Path | None, experiment: Any, settings: Any, config: Path | None
) -> Question:
    """Return the question between rivals that are named, or that a verdict leaves open.

    Raises
    ------
    InputError
        Where they are no rivals, or one is part of the model, or the verdict is not of the leg.
    """
    from pipelines.contracts.verdict import read
    from pipelines.diagnosis.detectability.planned_runs import usual_plant
    from pipelines.errors import InputError
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.rivals import rivals_in_verdict, rivals_named
    from pipelines.investigation.separation_problem import SeparationProblem
    from pipelines.mechanics.machine import THE_LEG
    from pipelines.workflow.investigation import step_diagnosed

    known = tuple(experiment.diagnose.known)
    runs = PlannedRuns(settings, usual_plant(experiment.mechanism), known=known)
    last = None
    if folder is None:
        rivals = rivals_named(labels, THE_LEG)
    else:
        file = folder / "verdict.json"
        verdict = read(file)
        # First whether it is of the leg: the labels of another machine would be refused for typos.
        runs = runs.as_in_verdict(verdict, file)
        rivals = rivals_in_verdict(verdict, file, THE_LEG)
        # A motion that was not recorded yet has shown nothing.
        last = step_diagnosed(verdict)
    for rival in rivals:
        if rival.label in known:
            raise InputError(
                f"{rival.label} is in diagnose.known, and so part of the model that all causes"
                " share; remove it there, or separate other causes"
            )
    # The diagnosed recordings lie where the experiment's other results are.
    results = folder.resolve().parent if folder else None
    geometry = planned_geometry(experiment)
    name, motions = excitations(config, settings, geometry, results, last)
    if folder is not None:
        runs = runs.after(motions)
    return Question(SeparationProblem.of(rivals, runs, motions[-1]), motions[-1], name)


def show_separation(title: str, separation: "Separation") -> None:
    """Show the posterior to expect under each truth."""
    from pipelines.investigation.doubt import DECIDED

    document = separation.as_json()
    labels = [one["cause"] for one in document["rivals"]]
    decided = f"decided ({DECIDED:.2f})"
    rows = [
        (label, *(f"{p:.2f}" for p in posterior), f"{share:.0%}")
        for label, posterior, share in zip(
            labels, document["expected_posterior"], document["decided"], strict=True
        )
    ]
    console.say(f"\n{title}, the probability of each cause to expect:")
    headings = (*labels, decided)
    console.table(("if it is", *headings), rows, numbers=", ".join(headings))


def evaluate_separation(file: Path, settings: Any, geometry: Any, question: Question) -> None:
    """Show how well an excitation separates rival causes."""
    from pipelines.design.quality import quality
    from pipelines.mechanics.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    result = quality(trajectory, settings, geometry)
    separated = question.problem.with_motion(trajectory)
    document = {"separation": separated.as_json()}
    console.emit({"file": str(file), **result.as_metadata(), **document})
    show_quality(str(file), result)
    show_separation(f"With {file}", separated)
    console.say(f"\n{file}: {criterion_text(settings, result)}")


def design_separation(
    output: Path, question: Question, geometry: Any, mechanism: dict[str, Any]
) -> None:
    """Design an excitation that separates rival causes, and write it."""
    from pipelines.investigation.separating_design import separating_design

    with console.progress("designing", total=1.0) as report:
        result = separating_design(question.problem, geometry, question.last, report)
    write_excitation(output, result.design, result.metadata(), geometry, mechanism)
    warn_of_cut(result.design)
    console.emit({"file": str(output), **result.metadata()})
    show_quality(str(output), result.design.quality)
    show_separation(f"With {question.name}", result.before)
    show_separation("With this one", result.separation)
    for one, other in result.inseparable:
        console.warn(f"no motion separates {one} and {other}; `exoid next` lists tests by hand")
    console.say(
        f"\n{output}: expected log odds of the worst pair {result.least:.3g};"
        f" stopped by {result.design.stopped_by}"
    )
