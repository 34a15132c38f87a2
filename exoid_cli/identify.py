"""``exoid identify``: friction from the empty exoskeleton, then inertia with the human."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli import completion
from exoid_cli.console import console
from exoid_cli.parameters_view import said, show_parameters
from exoid_cli.place import ConfigOption, inputs_and_folder, place_of, settings_in_force
from exoid_cli.steps import AgainOption, only

if TYPE_CHECKING:
    from pipelines.identification import Identified
    from pipelines.mechanics.machine import Machine


def identify(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE", help="motion/1 or recording/1 files.", show_default="motions/RUN.parquet of every run"
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Folder for parameters, residuals and figures.", show_default="identified/"
        ),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    method: Annotated[
        str | None,
        typer.Option(
            help="Estimator, also iv, wls, ols, irls or oe for short; docs/estimators.md tells of each.",
            show_default="[identify] method, weighted_least_squares",
            autocompletion=completion.methods,
        ),
    ] = None,
) -> None:
    """Fit the leg's parameters to training runs and measure the torque error on validation runs.

    \b
    Examples:
      exoid identify
      exoid identify motions/*.parquet -o identified/
      exoid identify motions/*.parquet -o iv/ --method instrumental_variables
    """
    from pipelines.contracts import PARAMETERS, RESIDUALS, describe
    from pipelines.estimation.estimators import estimator_named
    from pipelines.identification import identify as fit
    from pipelines.identification.validation import residuals
    from pipelines.mechanics.read import geometry_from, read_runs, refuse_another_mechanism

    if not files and output is None and method is None:
        only(context, place_of(config, lacking="no motion is given"), "identify", again=again)
        return
    files, output = inputs_and_folder("identify", files, output, config, "no motion is given")
    settings = settings_in_force(config)
    estimator = estimator_named(settings.identify.method if method is None else method)
    runs = read_runs(files, settings.filter, geometry_from(settings))
    refuse_another_mechanism(settings.mechanism, runs)
    with console.working("fitting"):
        found = fit(runs, estimator)
    config_used = settings.sections_about(runs[0].machine.is_exoskeleton, "mechanism", "filter") | {
        "identify": settings.identify.changed(method=estimator.name).model_dump(mode="json")
    }
    shared = {"joints": runs[0].joint_metadata} | describe(inputs=files, config=config_used)
    described = {
        "covariance": found.covariance.tolist(),
        "mechanism": runs[0].machine.mechanism.name,
        "geometry": runs[0].machine.told(runs[0].geometry),
        "method": found.method,
        "one_step": found.one_step.tolist(),
        "validation": found.validation.as_json(),
        "collinear": found.collinear,
        "unrealizable": found.unrealizable,
        "remarks": found.remarks,
        "angle_noise": found.angle_noise,
    }
    PARAMETERS.write(output / "parameters.parquet", found.parameters, shared | described)
    left = output / "residuals.parquet"
    with console.working("predicting every run"):
        RESIDUALS.write_pieces(left, residuals(runs, found.models, "baseline"), shared)
    if settings.identify.figures:
        from pipelines.identification.figures import draw

        with console.working("drawing"):
            draw(RESIDUALS.scan(left), output)
    _report(found, runs[0].machine)
    figures = sorted(path.name for path in output.glob("*.png")) if settings.identify.figures else []
    console.wrote(output, "parameters.parquet", "residuals.parquet", *figures)


def _report(found: "Identified", machine: "Machine") -> None:
    from pipelines.contracts.joints import either

    rows, unit = found.parameters.to_dict("records"), either(joint.unit("torque") for joint in machine.joints)
    console.emit(
        {
            "parameters": rows,
            "validation": found.validation.as_json(),
            "collinear": found.collinear,
            "unrealizable": found.unrealizable,
            "method": found.method,
            "remarks": found.remarks,
            "angle_noise": found.angle_noise,
        }
    )
    show_parameters(rows, machine.joints, found.one_step.tolist())
    console.say("")
    scores = {**found.validation.by_run, "all": found.validation.pooled}
    console.table(
        ("validation run", "joint", f"RMSE {unit}", "with reversals", f"torque rms {unit}"),
        [
            (
                run,
                joint,
                said(score.rmse[j], machine.joints, 3),
                said(score.rmse_unmasked[j], machine.joints, 3),
                said(score.torque_rms[j], machine.joints, 2),
            )
            for run, score in scores.items()
            for j, joint in enumerate(found.validation.joints)
        ],
        numbers=f"RMSE {unit}, with reversals, torque rms {unit}",
    )
    for sentence in found.remarks:
        console.say(f"{sentence}.")
    for sentence in [
        *found.angle_noise,
        *found.collinear,
        *(f"not a real {'leg' if machine.is_exoskeleton else 'machine'}: {s}" for s in found.unrealizable),
    ]:
        console.warn(sentence)
