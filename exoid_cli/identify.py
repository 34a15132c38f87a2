"""``exoid identify``: friction from the empty exoskeleton, then inertia with the human."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.identification import Identified
    from pipelines.mechanics.machine import Machine


def identify(
    files: Annotated[list[Path], typer.Argument(help="motion/1 files, or recording/1 files to be filtered first.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for parameters, residuals and figures.")],
    config: Annotated[Path | None, typer.Option("--config", help="exoid.toml: geometry, [filter], [identify].")] = None,
    method: Annotated[
        str | None, typer.Option(help="Estimator, weighted_least_squares unless [identify] says otherwise.")
    ] = None,
) -> None:
    """Fit the leg's parameters to training runs and measure the torque error on validation runs.

    \b
    Example:
      exoid identify motions/*.parquet -o identified/
      exoid identify motions/*.parquet -o iv/ --method instrumental_variables
    """
    from pipelines.contracts import PARAMETERS, RESIDUALS, describe
    from pipelines.estimation.estimators import estimator_named
    from pipelines.identification import identify as fit
    from pipelines.identification.validation import residuals
    from pipelines.mechanics.read import geometry_from, read_runs, refuse_another_mechanism
    from pipelines.settings import Experiment

    settings = Experiment.load(config) if config else Experiment()
    estimator = estimator_named(method or settings.identify.method)
    runs = read_runs(files, settings.filter, geometry_from(settings.mechanism))
    refuse_another_mechanism(settings.mechanism, runs)
    found = fit(runs, estimator)
    config_used = {
        "mechanism": settings.mechanism.model_dump(mode="json"),
        "filter": settings.filter.model_dump(mode="json"),
        "identify": settings.identify.changed(method=estimator.name).model_dump(mode="json"),
    }
    shared = {"joints": runs[0].joint_metadata} | describe(inputs=files, config=config_used)
    described = {
        "covariance": found.covariance.tolist(),
        "mechanism": runs[0].machine.mechanism.name,
        "geometry": runs[0].geometry.metadata(),
        "method": found.method,
        "one_step": found.one_step.tolist(),
        "validation": found.validation.as_json(),
        "collinear": found.collinear,
        "unrealizable": found.unrealizable,
    }
    PARAMETERS.write(output / "parameters.parquet", found.parameters, shared | described)
    left = output / "residuals.parquet"
    RESIDUALS.write_pieces(left, residuals(runs, found.models, "baseline"), shared)
    if settings.identify.figures:
        from pipelines.identification.figures import draw

        draw(RESIDUALS.scan(left), output)
    _report(found, runs[0].machine)


def _named(row: Mapping[Any, Any]) -> str:
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return " ".join(filter(None, (joint, row["symbol"], run)))


def _report(found: "Identified", machine: "Machine") -> None:
    rows, unit = found.parameters, machine.joints[0].unit("torque")

    def said(value: float, decimals: int = 4) -> str:
        # So many decimals do for a leg; a servo's inertia would be nought by them.
        return f"{value:.{decimals}f}" if machine.is_exoskeleton else f"{value:.5g}"

    console.emit(
        {
            "parameters": rows.to_dict("records"),
            "validation": found.validation.as_json(),
            "collinear": found.collinear,
            "unrealizable": found.unrealizable,
            "method": found.method,
            "remarks": found.remarks,
        }
    )
    console.table(
        ("parameter", "value", "95 % interval", "unit", "one step", "step"),
        [
            (
                _named(row),
                said(row["value"]),
                f"{said(row['ci95_low'])} … {said(row['ci95_high'])}",
                row["unit"],
                said(one),
                row["step"],
            )
            for row, one in zip(rows.to_dict("records"), found.one_step, strict=True)
        ],
        numbers="value, one step",
    )
    console.say("")
    scores = {**found.validation.by_run, "all": found.validation.pooled}
    console.table(
        ("validation run", "joint", f"RMSE {unit}", "with reversals", f"torque rms {unit}"),
        [
            (run, joint, said(score.rmse[j], 3), said(score.rmse_unmasked[j], 3), said(score.torque_rms[j], 2))
            for run, score in scores.items()
            for j, joint in enumerate(found.validation.joints)
        ],
        numbers=f"RMSE {unit}, with reversals, torque rms {unit}",
    )
    for sentence in found.remarks:
        console.say(f"{sentence}.")
    for sentence in [
        *found.collinear,
        *(f"not a real {'leg' if machine.is_exoskeleton else 'machine'}: {s}" for s in found.unrealizable),
    ]:
        console.warn(sentence)
