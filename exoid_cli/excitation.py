"""What every command about an excitation shares: the last one, the file of a new one, its table."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console
from exoid_cli.experiment_folder import in_experiment_folder, open_experiment

if TYPE_CHECKING:
    from pipelines.design.excitation import Design
    from pipelines.design.quality import Quality
    from pipelines.mechanics.geometry import Geometry
    from pipelines.mechanics.trajectory import Trajectory
    from pipelines.settings import Experiment


def planned_geometry(experiment: "Experiment") -> "Geometry":
    """Return the lengths and the gravity with which an experiment is planned."""
    from pipelines.mechanics.geometry import Geometry
    from pipelines.mechanics.read import geometry_from

    return geometry_from(experiment) or Geometry()


def excitations(
    config: Path | None,
    settings: Any,
    geometry: Any,
    results: Path | None = None,
    last: int | None = None,
) -> "tuple[str, list[Trajectory]]":
    """Return the excitations that were followed, or else are to be followed, and the last's name.

    Parameters
    ----------
    config : Path or None
        The experiment's exoid.toml.
    settings : DesignSettings
        They give the excitation where there is no file of one.
    geometry : Geometry
        Lengths and gravity.
    results : Path, optional
        Folder of the experiment's results, if it is not that of exoid.toml.
    last : int, optional
        The last step of an investigation that counts; by default all.
    """
    from pipelines.design.excitation import design
    from pipelines.mechanics.trajectory import read_trajectory
    from pipelines.workflow.investigation import motions_of

    if config is not None or in_experiment_folder():
        folder = open_experiment(config)
        motions = motions_of(folder.experiment, results or folder.out, last)
        files = [file for file in motions if file.is_file()]
        if files:
            return str(files[-1]), [read_trajectory(file) for file in files]
    return f"the excitation of {settings.criterion}", [design(settings, geometry).trajectory]


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


def warn_of_cut(design: "Design") -> None:
    """Warn where the time ended a search."""
    if design.stopped_by == "seconds":
        console.warn(
            f"the search was cut short after {design.settings.seconds:g} s, so a faster computer"
            " may find another design; raise design.seconds"
        )


def criterion_text(settings: Any, quality: "Quality") -> str:
    """Return the criterion of the settings and its value."""
    name = "crest factor" if settings.criterion == "multisine" else settings.criterion
    return f"{name} {quality.value(settings.criterion):.4g}"


def show_quality(file: str, quality: "Quality") -> None:
    """Show what can be identified with an excitation, and the margins to its limits."""
    conditioning = [
        ("condition number, 8 columns (the paper's criterion)", f"{quality.condition:.1f}"),
        ("condition number, 4 inertial columns", f"{quality.inertial_condition:.1f}"),
        ("condition number, columns scaled to unit norm", f"{quality.scaled_condition:.1f}"),
        ("log det A'A/N", f"{quality.log_det:.2f}"),
    ]
    headings: tuple[str, ...] = ("how well the regressor is conditioned", "value")
    console.table(headings, conditioning, numbers="value")
    console.say("")
    stated = quality.standard_errors.items()
    errors = [(name, f"{value:.2g}", quality.units[name]) for name, value in stated]
    console.table(
        ("parameter", "expected standard error", "unit"), errors, numbers="expected standard error"
    )
    console.say("")
    numbers = "lowest, highest, at least, at most, margin"
    headings = ("joint", "quantity", "unit", *numbers.split(", "), "")
    rows = [
        (
            *(m.joint, m.quantity, m.unit),
            *(f"{x:.4f}" for x in (m.lowest, m.highest, m.low, m.high, m.margin)),
            "" if m.kept else "OUT",
        )
        for m in quality.margins
    ]
    console.table(headings, rows, numbers=numbers)
    outside = [str(margin) for margin in quality.margins if not margin.kept]
    if outside:
        console.warn(f"{file}: outside its limits: {'; '.join(outside)}")
