"""``exoid design``: search an excitation, or judge one."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from exoid_cli.console import console
from exoid_cli.excitation import (
    criterion_text,
    excitations,
    planned_geometry,
    show_quality,
    warn_of_cut,
    write_excitation,
)
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, output_option
from exoid_cli.separate import design_separation, evaluate_separation, question_of
from exoid_cli.sizes import design_sizes, evaluate_sizes, sizes_of
from exoid_cli.stage_runner import run_stages


def design(
    context: typer.Context,
    causes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="CAUSE",
            help="With --separate: effect@joint, two or more; with --sizes: effect@joint=size.",
        ),
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
    sizes: Annotated[
        bool, typer.Option("--sizes", help="Show the given causes from the given sizes on.")
    ] = False,
    verdict: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="DIR", help="Separate the causes that a diagnosis leaves open."
        ),
    ] = None,
    criterion: Annotated[
        Literal["log_det", "condition", "scaled_condition", "multisine"] | None,
        typer.Option(help="Overrides exoid.toml's."),
    ] = None,
    harmonics: Annotated[
        int | None, typer.Option(min=1, max=100, help="Overrides exoid.toml's.")
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
      exoid design --sizes cogging@knee=0.5 base_tilt=0.02 -o small.parquet
    """
    from pipelines.errors import InputError

    if evaluate and output:
        raise InputError(
            "--evaluate and -o exclude each other: a judged excitation is not written; drop one"
        )
    if bool(causes) != (separate or sizes) or (separate + sizes + (verdict is not None)) > 1:
        raise InputError(
            "expected causes after --separate or --sizes, or --from DIR that names them, one of the"
            " three; as in `exoid design --separate EFFECT@JOINT EFFECT@JOINT -o next.parquet`"
        )
    decides = separate or verdict is not None
    if (decides or sizes) and not evaluate and not output:
        raise InputError(
            "-o: missing; an excitation for some causes is no step of the experiment, so name its"
            " file"
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
    geometry = planned_geometry(experiment)
    mechanism = experiment.sections("mechanism")
    if not decides and not sizes:
        if evaluate:
            _evaluate(evaluate, settings, geometry)
        elif output:
            # The other runs follow excitations of their own.
            runs = [run for run in experiment.run if run.trajectory is None]
            _design(output, settings, geometry, mechanism, runs)
        return
    if sizes:
        wanted = sizes_of(causes or (), experiment, settings)
        if evaluate:
            evaluate_sizes(evaluate, settings, geometry, wanted)
        elif output:
            name, motions = excitations(config, settings, geometry)
            design_sizes(output, wanted, geometry, (name, motions[-1]), mechanism)
        return
    question = question_of(causes or (), verdict, experiment, settings, config)
    if evaluate:
        evaluate_separation(evaluate, settings, geometry, question)
    elif output:
        design_separation(output, question, geometry, mechanism)


def _evaluate(file: Path, settings: Any, geometry: Any) -> None:
    from pipelines.design.quality import quality
    from pipelines.mechanics.trajectory import read_trajectory

    result = quality(read_trajectory(file), settings, geometry)
    console.emit({"file": str(file), **result.as_metadata()})
    show_quality(str(file), result)
    console.say(f"\n{file}: {criterion_text(settings, result)}")


def _design(
    output: Path, settings: Any, geometry: Any, mechanism: dict[str, Any], runs: list[Any]
) -> None:
    from pipelines.design.excitation import design
    from pipelines.design.lines import cut_periods

    with console.progress("designing", total=1.0) as report:
        result = design(settings, geometry, report)
    write_excitation(output, result, result.metadata(), geometry, mechanism)
    warn_of_cut(result)
    for warning in cut_periods(runs, result.trajectory):
        console.warn(warning)
    console.emit({"file": str(output), **result.metadata()})
    show_quality(str(output), result.quality)
    harmonics = f"{settings.harmonics} harmonics"
    if empty := result.detection_lines:
        odd = sum(line % 2 for line in empty)
        harmonics = (
            f"{settings.harmonics - len(empty)} odd harmonics up to"
            f" {max(result.trajectory.excited_lines)}, {odd} odd and {len(empty) - odd} even"
            f" detection lines up to {max(empty)}"
        )
    console.say(
        f"\n{output}: {criterion_text(settings, result.quality)}, {harmonics}, period"
        f" {result.trajectory.period_s:g} s, seed {settings.seed}; stopped by {result.stopped_by}"
    )
