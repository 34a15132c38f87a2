"""``exoid identify``: friction from the empty exoskeleton, then inertia with the human."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli import completion
from exoid_cli.console import console
from exoid_cli.parameters_view import said, show_parameters
from exoid_cli.place import ConfigOption, inputs_and_folder, place_of, settings_in_force
from exoid_cli.steps import AgainOption, only
from pipelines.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipelines.identification import Extension, Identified
    from pipelines.mechanics.machine import Machine
    from pipelines.mechanics.run import Run


def identify(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE",
            help="motion/1 or recording/1 files.",
            show_default="motions/RUN.parquet of every run",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for parameters, residuals and figures.",
            show_default="identified/",
        ),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    method: Annotated[
        str | None,
        typer.Option(
            help=(
                "Estimator, also iv, wls, ols, irls or oe for short; docs/estimators.md tells of"
                " each."
            ),
            show_default="[identify] method, weighted_least_squares",
            autocompletion=completion.methods,
        ),
    ] = None,
    causes: Annotated[
        Path | None,
        typer.Option(
            help="The parameters.parquet of a diagnosis: fit what it named, too, its shapes held."
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="What the model has besides, as rotor_inertia@knee; more than once for more.",
            show_default="nothing",
        ),
    ] = None,
    reversals: Annotated[
        bool | None,
        typer.Option(
            "--reversals/--no-reversals",
            help="Whether samples near reversals are fitted, too.",
            show_default="[identify] reversals, no",
        ),
    ] = None,
) -> None:
    """Fit the leg's parameters to training runs and measure the torque error on validation runs.

    \b
    Examples:
      exoid identify
      exoid identify motions/*.parquet -o identified/
      exoid identify motions/*.parquet -o iv/ --method instrumental_variables
      exoid identify -o refitted/ --causes diagnosed/parameters.parquet
      exoid identify motions/*.parquet -o rotor/ --effect rotor_inertia@knee
    """
    from pipelines.contracts import PARAMETERS, RESIDUALS, describe
    from pipelines.estimation.estimators import estimator_named
    from pipelines.identification import identify as fit
    from pipelines.mechanics.read import geometry_from, read_runs, refuse_another_mechanism

    if not files and output is None and (method, causes, effect, reversals) == (None,) * 4:
        only(context, place_of(config, lacking="no motion is given"), "identify", again=again)
        return
    if (causes or effect) and output is None:
        option = "--causes" if causes else "--effect"
        raise InputError(
            f"{option}: no folder is given; name one with -o, for identified/ is of the model"
            " without"
        )
    if output and (output / "verdict.json").exists():
        raise InputError(
            f"-o: {output} holds a diagnosis, which would be overwritten; name another folder"
        )
    if causes and output and (output / "parameters.parquet").resolve() == causes.resolve():
        raise InputError(
            f"-o: {output} is the folder of {causes}, which would be overwritten; name another"
            " folder"
        )
    files, output = inputs_and_folder("identify", files, output, config, "no motion is given")
    for contract, name in ((PARAMETERS, "parameters"), (RESIDUALS, "residuals")):
        contract.refuse_place(output / f"{name}.parquet")
    settings = settings_in_force(config)
    estimator = estimator_named(settings.identify.method if method is None else method)
    asked = settings.identify.changed(method=estimator.name, reversals=reversals)
    runs = read_runs(files, settings.filter, geometry_from(settings))
    refuse_another_mechanism(settings.mechanism, runs)
    with console.working("fitting"):
        found = fit(
            runs,
            estimator,
            _extension(effect or [], causes, runs, files),
            reversals=asked.reversals,
        )
    heeded = settings.sections_about(runs[0].machine.is_exoskeleton, "mechanism", "filter")
    config_used = heeded | {"identify": asked.model_dump(mode="json")}
    inputs = [*files, causes] if causes else files
    shared = {"joints": runs[0].joint_metadata} | describe(inputs=inputs, config=config_used)
    besides = {"effects": effect} if effect else {}
    besides |= {"causes": shared["inputs"][-1]} if causes else {}
    figures = _write(
        found, output, shared | {"method": found.method | besides}, figures=asked.figures
    )
    _report(found, runs[0].machine)
    console.wrote(output, "parameters.parquet", "residuals.parquet", *figures)


def _extension(
    labels: "Sequence[str]", causes: Path | None, runs: "Sequence[Run]", files: "Sequence[Path]"
) -> "Extension":
    """Return what the model has beside rigid body and friction."""
    from pipelines.contracts import PARAMETERS
    from pipelines.identification.extension import Extension, chosen, named

    beside = chosen(labels, runs[0].machine)
    of_diagnosis = named(PARAMETERS.read(causes), runs, files) if causes else Extension()
    if causes and not of_diagnosis.terms:
        console.say(f"{causes}: names nothing beside rigid body and friction.")
    return of_diagnosis.with_terms(beside)


def _write(
    found: "Identified", output: Path, shared: "dict[str, Any]", *, figures: bool
) -> list[str]:
    """Write parameters, residuals and, if asked, figures into a folder; return the figures'
    names."""
    from pipelines.contracts import PARAMETERS, RESIDUALS
    from pipelines.identification.validation import residuals

    run = found.runs[0]
    described = {
        "covariance": found.covariance.tolist(),
        "mechanism": run.machine.mechanism.name,
        "geometry": run.machine.told(run.geometry),
        "one_step": found.one_step.tolist(),
        "validation": found.validation.as_json(),
        "collinear": found.collinear,
        "unrealizable": found.unrealizable,
        "remarks": found.remarks,
        "angle_noise": found.angle_noise,
    }
    if found.each_run:
        described["each_run"] = found.each_run
    PARAMETERS.write(output / "parameters.parquet", found.parameters, shared | described)
    left = output / "residuals.parquet"
    with console.working("predicting every run"):
        model = "extended" if found.extension.terms else "baseline"
        RESIDUALS.write_pieces(
            left, residuals(found.runs, found.model_of, model, found.training.cutoff_hz), shared
        )
    if not figures:
        return []
    from pipelines.identification.figures import draw

    with console.working("drawing"):
        draw(RESIDUALS.scan(left), output)
    return sorted(path.name for path in output.glob("*.png"))


def _report(found: "Identified", machine: "Machine") -> None:
    from pipelines.contracts.joints import either

    rows, unit = (
        found.parameters.to_dict("records"),
        either(joint.unit("torque") for joint in machine.joints),
    )
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
        *(
            f"not a real {'leg' if machine.is_exoskeleton else 'machine'}: {s}"
            for s in found.unrealizable
        ),
    ]:
        console.warn(sentence)
