"""What ``exoid design --separate`` and ``exoid next`` share: rival causes, and what they show."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console
from exoid_cli.experiment_folder import in_experiment_folder, open_experiment

if TYPE_CHECKING:
    from pipelines.design.excitation import Design
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.rivals import Rival
    from pipelines.investigation.separation import Separation
    from pipelines.mechanics.trajectory import Trajectory

Question = tuple["list[Rival]", "PlannedRuns"]
"""Rivals, and the runs that are to decide between them."""


def question_of(
    labels: Sequence[str], verdict: Path | None, experiment: Any, settings: Any
) -> Question:
    """Return the rivals that are named, or that a verdict leaves open, and the runs to plan.

    Raises
    ------
    InputError
        Where they are no rivals, or one is part of the model, or the verdict is not of the leg.
    """
    from pipelines.diagnosis.detectability.planned_runs import usual_plant
    from pipelines.errors import InputError
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.rivals import rivals_in_verdict, rivals_named
    from pipelines.mechanics.machine import THE_LEG

    known = tuple(experiment.diagnose.known)
    runs = PlannedRuns(settings, usual_plant(experiment.mechanism), known=known)
    if verdict is None:
        rivals = rivals_named(labels, THE_LEG)
    else:
        # First whether it is of the leg: the labels of another machine would be refused for typos.
        runs = runs.as_in_verdict(verdict)
        rivals = rivals_in_verdict(verdict, THE_LEG)
    for rival in rivals:
        if rival.label in known:
            raise InputError(
                f"{rival.label} is in diagnose.known, and so part of the model that all causes"
                " share; remove it there, or separate other causes"
            )
    return rivals, runs


def last_excitation(config: Path | None, settings: Any, geometry: Any) -> "tuple[str, Trajectory]":
    """Return the experiment's excitation, else the one that its settings give, and its name."""
    from pipelines.design.excitation import design
    from pipelines.mechanics.trajectory import read_trajectory

    if config is not None or in_experiment_folder():
        file = open_experiment(config).step("design").target
        if file.is_file():
            return str(file), read_trajectory(file)
    return f"the excitation of {settings.criterion}", design(settings, geometry).trajectory


def write_excitation(
    output: Path,
    design: "Design",
    metadata: dict[str, Any],
    geometry: Any,
    mechanism: dict[str, Any],
) -> None:
    """Write an excitation with its settings."""
    from pipelines.contracts import TRAJECTORY, describe

    settings = design.settings.model_dump(mode="json")
    config = {"design": settings, "geometry": vars(geometry)} | mechanism
    TRAJECTORY.write(output, design.frame(), metadata | describe(config=config))


def show_separation(title: str, separation: "Separation") -> None:
    """Show the posterior to expect under each truth."""
    from pipelines.investigation.separation import DECIDED

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
