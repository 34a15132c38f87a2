"""``exoid identify``: friction from the empty exoskeleton, then inertia with the human."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli import completion
from exoid_cli.console import console
from exoid_cli.experiment_folder import inputs_and_folder, open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, files_argument, output_option
from exoid_cli.parameters_view import format_value, show_parameters
from exoid_cli.stage_runner import run_stages
from pipelines.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipelines.identification import Extension, IdentifiedModel
    from pipelines.mechanics.machine import Machine
    from pipelines.mechanics.run import Run


def identify(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        files_argument("motion/1 or recording/1 files.", "motions/RUN.parquet of every run"),
    ] = None,
    output: Annotated[
        Path | None, output_option("Folder for parameters, residuals and figures.", "identified/")
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    method: Annotated[
        str | None,
        typer.Option(
            help=(
                "Estimator, also iv, wls, ols, irls or oe for short; docs/estimators.md explains"
                " each."
            ),
            show_default="[identify] method, weighted_least_squares",
            autocompletion=completion.methods,
        ),
    ] = None,
    causes: Annotated[
        Path | None,
        typer.Option(
            help="parameters.parquet of a diagnosis: fit its causes too, their shapes fixed."
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="Further effect of the model, as rotor_inertia@knee; repeatable.",
            show_default="nothing",
        ),
    ] = None,
    reversals: Annotated[
        bool | None,
        typer.Option(
            "--reversals/--no-reversals",
            help="Whether to fit samples near reversals, too.",
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
        folder = open_experiment(config, problem="no motion is given")
        run_stages(context, folder, "identify", again=again)
        return
    if (causes or effect) and output is None:
        raise InputError(
            f"{'--causes' if causes else '--effect'}: no folder is given; name one with -o, since"
            " identified/ is for the model without"
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
    # Before the fit, whose result would be lost.
    for contract, name in ((PARAMETERS, "parameters"), (RESIDUALS, "residuals")):
        contract.refuse_place(output / f"{name}.parquet")
    settings = settings_in_force(config)
    estimator = estimator_named(settings.identify.method if method is None else method)
    options = settings.identify.changed(method=estimator.name, reversals=reversals)
    runs = read_runs(files, settings.filter, geometry_from(settings))
    refuse_another_mechanism(settings.mechanism, runs)
    with console.working("fitting"):
        extension = _extension(effect or [], causes, runs, files)
        model = fit(runs, estimator, extension, reversals=options.reversals)
    used_settings = settings.sections_about(runs[0].machine.is_exoskeleton, "mechanism", "filter")
    config_used = used_settings | {"identify": options.model_dump(mode="json")}
    inputs = [*files, causes] if causes else files
    machine = runs[0].machine
    shared = {
        "joints": machine.joint_metadata,
        "geometry": machine.metadata(runs[0].geometry),
    } | describe(inputs=inputs, config=config_used)
    method_used = dict(model.method)
    if effect:
        method_used["effects"] = effect
    if causes:
        # The last input, with its hash: the diagnosis whose causes are refitted.
        method_used["causes"] = shared["inputs"][-1]
    figures = _write(model, output, shared | {"method": method_used}, figures=options.figures)
    _report(model, machine)
    console.wrote(output, "parameters.parquet", "residuals.parquet", *figures)


def _extension(
    labels: "Sequence[str]", causes: Path | None, runs: "Sequence[Run]", files: "Sequence[Path]"
) -> "Extension":
    """Return the effects of the model in addition to rigid body and friction."""
    from pipelines.contracts import PARAMETERS
    from pipelines.identification.extension import Extension, chosen, named

    by_label = chosen(labels, runs[0].machine, runs)
    of_diagnosis = named(PARAMETERS.read(causes), runs, files) if causes else Extension()
    if causes and not of_diagnosis.terms:
        console.say(f"{causes}: names nothing in addition to rigid body and friction.")
    return of_diagnosis.with_terms(by_label)


def _write(
    model: "IdentifiedModel", output: Path, shared: "dict[str, Any]", *, figures: bool
) -> list[str]:
    """Write parameters, residuals and figures into a folder; return the figures' names."""
    from pipelines.contracts import PARAMETERS, RESIDUALS
    from pipelines.identification.validation import residuals

    run = model.runs[0]
    described = {
        "covariance": model.covariance.tolist(),
        "mechanism": run.machine.mechanism.name,
        "one_step": model.one_step.tolist(),
        "validation": model.validation.as_json(),
        **_remarks(model),
    }
    if model.each_run:
        described["each_run"] = model.each_run
    PARAMETERS.write(output / "parameters.parquet", model.parameters, shared | described)
    residuals_file = output / "residuals.parquet"
    with console.working("predicting every run"):
        # The names of models in residuals/1, which a report draws.
        name = "extended" if model.extension.terms else "baseline"
        rows = residuals(model.runs, model.model_of, name, model.training.cutoff_hz)
        # In pieces, as the residuals of all runs need not fit into memory.
        RESIDUALS.write_pieces(residuals_file, rows, shared)
    if not figures:
        return []
    from pipelines.identification.figures import draw

    with console.working("drawing"):
        return draw(RESIDUALS.scan(residuals_file), output)


def _remarks(model: "IdentifiedModel") -> dict[str, Any]:
    """Return the sentences on a model for the metadata of its file."""
    names = ("collinear", "unrealizable", "remarks", "angle_noise")
    return {name: getattr(model, name) for name in names}


def _report(model: "IdentifiedModel", machine: "Machine") -> None:
    from pipelines.contracts.joints import either

    rows = model.parameters.to_dict("records")
    unit = either(joint.unit("torque") for joint in machine.joints)
    about = {"parameters": rows, "validation": model.validation.as_json()}
    console.emit(about | {"method": model.method} | _remarks(model))
    show_parameters(rows, machine.joints, model.one_step.tolist())
    console.say("")
    errors_of_runs: list[tuple[str, ...]] = []
    for run, by_joint in model.validation.as_json().items():
        for joint, errors in by_joint.items():
            decimals = zip(errors.values(), (3, 3, 2), strict=True)
            errors_of_runs.append(
                (run, joint, *(format_value(x, machine.joints, d) for x, d in decimals))
            )
    headings = ("validation run", "joint", f"RMSE {unit}", "with reversals", f"torque rms {unit}")
    console.table(headings, errors_of_runs, numbers=", ".join(headings[2:]))
    for sentence in model.remarks:
        console.say(f"{sentence}.")
    kind = "leg" if machine.is_exoskeleton else "machine"
    unrealizable = [f"not a real {kind}: {reason}" for reason in model.unrealizable]
    for sentence in [*model.angle_noise, *model.collinear, *unrealizable]:
        console.warn(sentence)
