"""What ``exoid design --sizes`` does: an excitation that shows causes from some sizes on."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console
from exoid_cli.excitation import show_quality, warn_of_cut, write_excitation

if TYPE_CHECKING:
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.wanted_sizes import SmallestSizes, WantedSize
    from pipelines.mechanics.trajectory import Trajectory

Sizes = tuple["list[WantedSize]", "PlannedRuns"]
"""Wanted sizes, and the runs that are to show them."""


def sizes_of(texts: Sequence[str], experiment: Any, settings: Any) -> Sizes:
    """Return the causes with the wanted sizes that a user gives, and the runs to plan.

    Raises
    ------
    InputError
        If a text is no cause with a size, or its cause is in ``diagnose.known``.
    """
    from pipelines.diagnosis.detectability.planned_runs import usual_plant
    from pipelines.errors import InputError
    from pipelines.investigation.planned import PlannedRuns
    from pipelines.investigation.wanted_sizes import wanted_sizes
    from pipelines.mechanics.machine import THE_LEG

    known = tuple(experiment.diagnose.known)
    wanted = wanted_sizes(texts, THE_LEG)
    for one in wanted:
        if one.label in known:
            raise InputError(
                f"{one.label} is in diagnose.known, and so part of the model; remove it there, or"
                " leave it out"
            )
    return wanted, PlannedRuns(settings, usual_plant(experiment.mechanism), known=known)


def evaluate_sizes(file: Path, settings: Any, geometry: Any, sizes: Sizes) -> None:
    """Show from which sizes on an excitation shows causes."""
    from pipelines.design.quality import quality
    from pipelines.investigation.sizes_design import smallest_sizes
    from pipelines.mechanics.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    result = quality(trajectory, settings, geometry)
    smallest = smallest_sizes(*sizes, trajectory)
    console.emit({"file": str(file), **result.as_metadata(), "sizes": smallest.as_json()})
    show_quality(str(file), result)
    _show({str(file): smallest})


def design_sizes(
    output: Path,
    sizes: Sizes,
    geometry: Any,
    last: "tuple[str, Trajectory]",
    mechanism: dict[str, Any],
) -> None:
    """Design an excitation for the wanted sizes, and write it."""
    from pipelines.investigation.sizes_design import sizes_design, smallest_sizes

    wanted, runs = sizes
    name, trajectory = last
    before = smallest_sizes(wanted, runs, trajectory)
    with console.progress("designing", total=1.0) as report:
        result = sizes_design(before, runs, geometry, report)
    write_excitation(output, result.design, result.metadata(), geometry, mechanism)
    warn_of_cut(result.design)
    console.emit({"file": str(output), **result.metadata()})
    show_quality(str(output), result.design.quality)
    _show({name: result.before, str(output): result.sizes})
    console.say(f"\n{output}: stopped by {result.design.stopped_by}")


def _show(columns: "dict[str, SmallestSizes]") -> None:
    """Show the wanted sizes, and the smallest that each excitation shows."""
    judged = list(columns.values())
    rows = [
        (
            one.label,
            one.unit,
            f"{one.size:.4g}",
            *(f"{sizes.smallest[k]:.4g}" for sizes in judged),
            "yes" if judged[-1].shares()[k] >= 1.0 else "NO",
        )
        for k, one in enumerate(judged[-1].wanted)
    ]
    console.say(
        "\nSmallest size (of a stiffness the largest) that a diagnosis would name in nine of ten"
        " experiments:"
    )
    numbers = ("wanted", *columns)
    console.table(("cause", "unit", *numbers, "shows"), rows, numbers=", ".join(numbers))
    hidden = [row[0] for row in rows if row[-1] == "NO"]
    if hidden:
        console.warn(
            f"{', '.join(hidden)}: too small an effect for this excitation; wider [design.bounds],"
            " a longer run ([design.noise] duration_s) or less noise would show it"
        )
