"""``exoid identify``: friction from the empty exoskeleton, then inertia with the human."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.identification import Identified


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
      exoid identify motions/*.parquet -o identified/ --method instrumental_variables
    """
    from pipelines.contracts import PARAMETERS, RESIDUALS, describe
    from pipelines.estimation.estimators import estimator_named
    from pipelines.identification import identify as fit
    from pipelines.identification.validation import residuals
    from pipelines.mechanics.read import geometry_from, read_runs
    from pipelines.settings import Experiment

    settings = Experiment.load(config) if config else Experiment()
    estimator = estimator_named(method or settings.identify.method)
    runs = read_runs(files, settings.filter, geometry_from(settings.mechanism))
    found = fit(runs, estimator)
    config_used = {
        "mechanism": settings.mechanism.model_dump(mode="json"),
        "filter": settings.filter.model_dump(mode="json"),
        "identify": settings.identify.changed(method=estimator.name).model_dump(mode="json"),
    }
    shared = {"joints": runs[0].joint_metadata} | describe(inputs=files, config=config_used)
    described = {
        "covariance": found.covariance.tolist(),
        "mechanism": "leg",
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
    _report(found)


def _named(row: Mapping[Any, Any]) -> str:
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return " ".join(filter(None, (joint, row["symbol"], run)))


def _report(found: "Identified") -> None:
    rows = found.parameters
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
                f"{row['value']:.4f}",
                f"{row['ci95_low']:.4f} … {row['ci95_high']:.4f}",
                row["unit"],
                f"{one:.4f}",
                row["step"],
            )
            for row, one in zip(rows.to_dict("records"), found.one_step, strict=True)
        ],
        numbers="value, one step",
    )
    console.say("")
    scores = {**found.validation.by_run, "all": found.validation.pooled}
    console.table(
        ("validation run", "joint", "RMSE N·m", "with reversals", "torque rms N·m"),
        [
            (run, joint, f"{score.rmse[j]:.3f}", f"{score.rmse_unmasked[j]:.3f}", f"{score.torque_rms[j]:.2f}")
            for run, score in scores.items()
            for j, joint in enumerate(found.validation.joints)
        ],
        numbers="RMSE N·m, with reversals, torque rms N·m",
    )
    for sentence in found.remarks:
        console.say(f"{sentence}.")
    for sentence in [*found.collinear, *(f"not a real leg: {s}" for s in found.unrealizable)]:
        console.warn(sentence)
