"""``exoid design``: find an excitation, or judge one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exoid_cli.console import console
from exoid_cli.place import ConfigOption, place_of, settings_in_force
from exoid_cli.steps import AgainOption, only

if TYPE_CHECKING:
    from pipelines.design.quality import Quality


def design(
    context: typer.Context,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="The trajectory/1 file to write.",
            show_default="trajectory.parquet",
        ),
    ] = None,
    config: ConfigOption = None,
    evaluate: Annotated[
        Path | None,
        typer.Option("--evaluate", metavar="FILE", help="Judge this excitation, Parquet or TOML."),
    ] = None,
    criterion: Annotated[
        Literal["log_det", "condition", "scaled_condition"] | None,
        typer.Option(help="Wins over exoid.toml's."),
    ] = None,
    harmonics: Annotated[
        int | None, typer.Option(min=1, max=20, help="Wins over exoid.toml's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Wins over exoid.toml's.")] = None,
    again: AgainOption = False,
) -> None:
    """Search the excitation that tells the parameters apart best, or judge a given one.

    \b
    Examples:
      exoid design
      exoid design --config exoid.toml -o trajectory.parquet
      exoid design --evaluate trajectory.toml
    """
    from pipelines.errors import InputError
    from pipelines.mechanics.geometry import Geometry
    from pipelines.mechanics.read import geometry_from

    if evaluate and output:
        raise InputError(
            "--evaluate and -o exclude each other: a judged excitation is not written; drop one"
        )
    if not evaluate and not output:
        place = place_of(config, lacking="neither -o FILE nor --evaluate FILE is given")
        if criterion is harmonics is seed is None:
            only(context, place, "design", again=again)
            return
        output = place.step("design").target
    experiment = settings_in_force(config)
    settings = experiment.design.changed(criterion=criterion, harmonics=harmonics, seed=seed)
    experiment.mechanism.refuse_all_but_the_leg("`exoid design`")
    geometry = geometry_from(experiment) or Geometry()
    if evaluate:
        _evaluate(evaluate, settings, geometry)
    elif output:
        _design(output, settings, geometry, experiment.sections("mechanism"))


def _evaluate(file: Path, settings: Any, geometry: Any) -> None:
    from pipelines.design.quality import quality
    from pipelines.mechanics.trajectory import read_trajectory

    found = quality(read_trajectory(file), settings, geometry)
    console.emit({"file": str(file), **found.as_metadata()})
    _show(str(file), found)
    console.say(f"\n{file}: {settings.criterion} {found.value(settings.criterion):.4g}")


def _design(output: Path, settings: Any, geometry: Any, mechanism: dict[str, Any]) -> None:
    from pipelines.contracts import TRAJECTORY, describe
    from pipelines.design.excitation import design

    with console.progress("designing", total=1.0) as report:
        found = design(settings, geometry, report)
    config = {"design": settings.model_dump(mode="json"), "geometry": vars(geometry)} | mechanism
    TRAJECTORY.write(output, found.frame(), found.metadata() | describe(config=config))
    if found.stopped_by == "seconds":
        console.warn(
            f"the search was cut short after {settings.seconds:g} s, so another machine may find"
            " another design; raise design.seconds"
        )
    console.emit({"file": str(output), **found.metadata()})
    _show(str(output), found.quality)
    console.say(
        f"\n{output}: {settings.criterion} {found.quality.value(settings.criterion):.4g},"
        f" {settings.harmonics} harmonics, period {found.trajectory.period_s:g} s, seed"
        f" {settings.seed}; stopped by {found.stopped_by}"
    )


def _show(file: str, found: "Quality") -> None:
    console.table(
        ("how well the regressor is conditioned", "value"),
        [
            ("condition number, 8 columns (the paper's criterion)", f"{found.condition:.1f}"),
            ("condition number, 4 inertial columns", f"{found.inertial_condition:.1f}"),
            ("condition number, columns scaled to unit norm", f"{found.scaled_condition:.1f}"),
            ("log det A'A/N", f"{found.log_det:.2f}"),
        ],
        numbers="value",
    )
    console.say("")
    errors = [
        (name, f"{value:.2g}", found.units[name]) for name, value in found.standard_errors.items()
    ]
    console.table(
        ("parameter", "expected standard error", "unit"), errors, numbers="expected standard error"
    )
    console.say("")
    headings = (
        "joint",
        "quantity",
        "unit",
        "lowest",
        "highest",
        "at least",
        "at most",
        "margin",
        "",
    )
    rows = [
        (
            m.joint,
            m.quantity,
            m.unit,
            *(f"{x:.4f}" for x in (m.lowest, m.highest, m.low, m.high)),
            f"{m.margin:.4f}",
            "" if m.kept else "OUT",
        )
        for m in found.margins
    ]
    console.table(headings, rows, numbers="lowest, highest, at least, at most, margin")
    outside = [str(margin) for margin in found.margins if not margin.kept]
    if outside:
        console.warn(f"{file}: outside its limits: {'; '.join(outside)}")
