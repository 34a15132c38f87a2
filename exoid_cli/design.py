"""``exoid design``: search an excitation, or judge one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, output_option
from exoid_cli.separate import (
    Question,
    last_excitation,
    question_of,
    show_separation,
    write_excitation,
)
from exoid_cli.stage_runner import run_stages

if TYPE_CHECKING:
    from pipelines.design.excitation import Design
    from pipelines.design.quality import Quality
    from pipelines.mechanics.trajectory import Trajectory


def design(
    context: typer.Context,
    causes: Annotated[
        list[str] | None,
        typer.Argument(metavar="CAUSE", help="With --separate: effect@joint, two or more."),
    ] = None,
    output: Annotated[
        Path | None, output_option("The trajectory/1 file to write.", "trajectory.parquet")
    ] = None,
    config: ConfigOption = None,
    evaluate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Judge this excitation, Parquet or TOML.")
    ] = None,
    separate: Annotated[
        bool, typer.Option("--separate", help="Separate the given causes best.")
    ] = False,
    verdict: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="DIR", help="Separate the causes that a diagnosis leaves open."
        ),
    ] = None,
    criterion: Annotated[
        Literal["log_det", "condition", "scaled_condition"] | None,
        typer.Option(help="Overrides exoid.toml's."),
    ] = None,
    harmonics: Annotated[
        int | None, typer.Option(min=1, max=20, help="Overrides exoid.toml's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Overrides exoid.toml's.")] = None,
    again: AgainOption = False,
) -> None:
    """Search the excitation that separates the parameters best, or judge a given one.

    \b
    Examples:
      exoid design
      exoid design --config exoid.toml -o trajectory.parquet
      exoid design --evaluate trajectory.toml
      exoid design --separate base_tilt rotor_inertia@knee -o next.parquet
      exoid design --from diagnosed -o next.parquet
    """
    from pipelines.errors import InputError
    from pipelines.mechanics.geometry import Geometry
    from pipelines.mechanics.read import geometry_from

    if evaluate and output:
        raise InputError(
            "--evaluate and -o exclude each other: a judged excitation is not written; drop one"
        )
    if bool(causes) != separate or (separate and verdict):
        raise InputError(
            "expected causes after --separate, or --from DIR that names them, one of the two; as in"
            " `exoid design --separate EFFECT@JOINT EFFECT@JOINT -o next.parquet`"
        )
    decides = separate or verdict is not None
    if decides and not evaluate and not output:
        raise InputError(
            "-o: missing; an excitation that separates causes is no step of the experiment, so name"
            " its file"
        )
    if not evaluate and not output:
        folder = open_experiment(config, problem="neither -o FILE nor --evaluate FILE is given")
        # With other options than its settings, a design is no step of the experiment.
        if all(option is None for option in (criterion, harmonics, seed)):
            run_stages(context, folder, "design", again=again)
            return
        output = folder.step("design").target
    experiment = settings_in_force(config)
    settings = experiment.design.changed(criterion=criterion, harmonics=harmonics, seed=seed)
    experiment.mechanism.refuse_all_but_the_leg("`exoid design`")
    geometry = geometry_from(experiment) or Geometry()
    question = question_of(causes or (), verdict, experiment, settings) if decides else None
    last = last_excitation(config, settings, geometry) if decides else None
    if evaluate:
        _evaluate(evaluate, settings, geometry, question, last)
    elif output and question and last:
        _separate(output, question, geometry, last, experiment.sections("mechanism"))
    elif output:
        _design(output, settings, geometry, experiment.sections("mechanism"))


def _evaluate(
    file: Path,
    settings: Any,
    geometry: Any,
    question: "Question | None",
    last: "tuple[str, Trajectory] | None",
) -> None:
    from pipelines.design.quality import quality
    from pipelines.investigation.separating_design import separation, separation_of_last
    from pipelines.mechanics.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    result = quality(trajectory, settings, geometry)
    separated = None
    if question and last:
        rivals, runs = question
        # As large as in the last excitation, as a design supposes them.
        before = separation_of_last(rivals, runs, last[1])
        separated = separation(before.rivals, runs, trajectory)
    document = {"separation": separated.as_json()} if separated else {}
    console.emit({"file": str(file), **result.as_metadata(), **document})
    _show(str(file), result)
    if separated:
        show_separation(f"With {file}", separated)
    console.say(f"\n{file}: {settings.criterion} {result.value(settings.criterion):.4g}")


def _separate(
    output: Path,
    question: "Question",
    geometry: Any,
    last: "tuple[str, Trajectory]",
    mechanism: dict[str, Any],
) -> None:
    from pipelines.investigation.separating_design import separating_design, separation_of_last

    rivals, runs = question
    before = separation_of_last(rivals, runs, last[1])
    with console.progress("designing", total=1.0) as report:
        result = separating_design(before, runs, geometry, report)
    write_excitation(output, result.design, result.metadata(), geometry, mechanism)
    _warn_of_cut(result.design)
    console.emit({"file": str(output), **result.metadata()})
    _show(str(output), result.design.quality)
    show_separation(f"With {last[0]}", result.before)
    show_separation("With this one", result.separation)
    console.say(
        f"\n{output}: expected log odds of the worst pair {result.separation.least():.3g};"
        f" stopped by {result.design.stopped_by}"
    )


def _warn_of_cut(design: "Design") -> None:
    if design.stopped_by == "seconds":
        console.warn(
            f"the search was cut short after {design.settings.seconds:g} s, so a faster computer"
            " may find another design; raise design.seconds"
        )


def _design(output: Path, settings: Any, geometry: Any, mechanism: dict[str, Any]) -> None:
    from pipelines.design.excitation import design

    with console.progress("designing", total=1.0) as report:
        result = design(settings, geometry, report)
    write_excitation(output, result, result.metadata(), geometry, mechanism)
    _warn_of_cut(result)
    console.emit({"file": str(output), **result.metadata()})
    _show(str(output), result.quality)
    console.say(
        f"\n{output}: {settings.criterion} {result.quality.value(settings.criterion):.4g},"
        f" {settings.harmonics} harmonics, period {result.trajectory.period_s:g} s, seed"
        f" {settings.seed}; stopped by {result.stopped_by}"
    )


def _show(file: str, quality: "Quality") -> None:
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
