"""``exoid design --separate`` and ``--from``: the excitation that decides between causes."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.rivals import Rival
    from pipelines.investigation.separation import Separation

Question = tuple["list[Rival]", "PlannedRuns"]
"""Rivals, and the runs that are to decide between them."""


def question_of(
    labels: Sequence[str], verdict: Path | None, experiment: Any, settings: Any
) -> Question:
    """Return the rivals that are named, or that a verdict leaves open, and the runs to plan."""
    from pipelines.diagnosis.detectability.planned_runs import usual_plant
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.rivals import rivals_in_verdict, rivals_named
    from pipelines.mechanics.machine import THE_LEG

    known = tuple(experiment.diagnose.known)
    runs = PlannedRuns(settings, usual_plant(experiment.mechanism), known=known)
    if verdict is None:
        return rivals_named(labels, THE_LEG), runs
    return rivals_in_verdict(verdict, THE_LEG), runs.as_in_verdict(verdict)


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
