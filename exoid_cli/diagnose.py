"""``exoid diagnose``: find what the model gets wrong, its physical cause, and the gain."""

import json
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import inputs_and_folder, open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, files_argument, output_option
from exoid_cli.stage_runner import run_stages
from exoid_cli.verdict_view import show_verdict

if TYPE_CHECKING:
    from pipelines.contracts import Contract
    from pipelines.contracts.verdict import Verdict
    from pipelines.diagnosis.diagnosis import Diagnosis
    from pipelines.mechanics.motion import Motion
    from pipelines.settings import Experiment


def diagnose(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        files_argument(
            "recording/1 or motion/1 files, some to train, some to validate.",
            "recordings/RUN.parquet of every run",
        ),
    ] = None,
    output: Annotated[
        Path | None, output_option("Folder for verdict, tables and figures.", "diagnosed/", "--out")
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    known: Annotated[
        list[str] | None,
        typer.Option(
            help="Effect known to be present, as rotor_inertia@knee; repeatable.",
            show_default="[diagnose] known, nothing",
        ),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(
            help="Kind of fault that does not stop the diagnosis, as clock; repeatable.",
            show_default="[diagnose] accept, nothing",
        ),
    ] = None,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Whether to draw the figures.")
    ] = True,
) -> None:
    """Name what rigid body and friction get wrong, extend the model with it, and measure the gain.

    \b
    Examples:
      exoid diagnose
      exoid diagnose recordings/*.parquet -o diagnosed/
      exoid diagnose recordings/*.parquet --known rotor_inertia@knee
    """
    from pipelines.contracts.atomic import folder_to_fill
    from pipelines.contracts.verdict import check
    from pipelines.diagnosis.diagnose import diagnose as find
    from pipelines.diagnosis.verdict.figures import FIGURES, WITH_DETECTION_LINES
    from pipelines.diagnosis.verdict.verdict import verdict
    from pipelines.mechanics.read import geometry_from, read_motions, refuse_another_mechanism

    if not files and output is None and figures and not known and not accept:
        experiment = open_experiment(config, problem="no recording is given")
        run_stages(context, experiment, "diagnose", again=again)
        return
    files, output = inputs_and_folder("diagnose", files, output, config, "no recording is given")
    settings = settings_in_force(config)
    chosen = settings.diagnose.changed(known=known or None, accept=accept or None)
    settings = settings.model_copy(update={"diagnose": chosen})
    # Before the search, as its result would be lost.
    for name, contract in _tables().items():
        contract.refuse_place(output / f"{name}.parquet")
    motions = read_motions(files, settings.filter, geometry_from(settings))
    refuse_another_mechanism(settings.mechanism, motions)
    with folder_to_fill(output), console.progress("diagnosing", 1.0) as report:
        diagnosis = find(motions, report, chosen.known, chosen.accept)
    document = verdict(diagnosis)
    drawn = [*FIGURES, *([WITH_DETECTION_LINES] if diagnosis.detection_lines else [])]
    # Checked before anything is written, so that a verdict on disk is always a valid one.
    checked = check(document, str(output / "verdict.json"))
    _write(output, diagnosis, document, checked if figures else None, motions, files, settings)
    console.emit(document)
    show_verdict(checked, motions[0].machine.joints)
    console.wrote(
        output,
        "verdict.json",
        *(f"{name}.parquet" for name in _tables()),
        "detectability.json",
        *(f"{name}.png" for name in drawn if figures),
    )


def _tables() -> "dict[str, Contract]":
    """Return the contracts of the tables that a diagnosis writes, by their names."""
    from pipelines.contracts import CANDIDATES, PARAMETERS, RESIDUALS

    return {"parameters": PARAMETERS, "residuals": RESIDUALS, "candidates": CANDIDATES}


def _write(
    output: Path,
    diagnosis: "Diagnosis",
    document: dict[str, Any],
    to_draw: "Verdict | None",
    motions: "Sequence[Motion]",
    files: Sequence[Path],
    settings: "Experiment",
) -> None:
    """Write all files of a diagnosis or none, with the figures of ``to_draw`` if it is given."""
    from pipelines.contracts import describe
    from pipelines.contracts.atomic import all_or_none, write_text
    from pipelines.diagnosis.detectability.detectability import as_json, detectability
    from pipelines.diagnosis.verdict.candidate_table import candidates

    machine, geometry = motions[0].machine, motions[0].geometry
    sections = ("mechanism", "filter", "diagnose")
    used_settings = settings.sections_about(machine.is_exoskeleton, *sections)
    shared = {"joints": machine.joint_metadata} | describe(files, used_settings)
    model = _about_model(diagnosis, motions, files)
    frames = {
        "parameters": diagnosis.parameters,
        "residuals": diagnosis.residuals,
        "candidates": candidates(diagnosis),
    }
    detectable = as_json(detectability(diagnosis.fitted_runs, diagnosis.baseline, diagnosis.floor))
    # The verdict last: whoever sees it finds the tables of the same diagnosis next to it.
    with all_or_none(output, last="verdict.json") as folder:
        for name, contract in _tables().items():
            # Without gravity, angles of residuals have no limit.
            metadata = shared | {"geometry": machine.metadata(geometry)}
            metadata |= model if name == "parameters" else {}
            contract.write(folder / f"{name}.parquet", frames[name], metadata)
        for name, content in (("detectability", detectable), ("verdict", document)):
            text = json.dumps(content | {"provenance": shared}, indent=1, ensure_ascii=False)
            write_text(folder / f"{name}.json", f"{text}\n")
        if to_draw:
            from pipelines.diagnosis.verdict.figures.drawing import draw

            draw(diagnosis, to_draw, folder)
        written = {path.name for path in folder.iterdir()}
    _remove_old_figures(output, written)


def _about_model(
    diagnosis: "Diagnosis", motions: "Sequence[Motion]", files: Sequence[Path]
) -> dict[str, Any]:
    """Return the metadata of the extended model's parameters."""
    from pipelines.contracts.provenance import recording_behind

    recordings = {}
    if diagnosis.each_run:  # hashing reads whole files
        for motion, path in zip(motions, files, strict=True):
            recordings[motion.file] = recording_behind(path)
    return {
        "covariance": diagnosis.covariance.tolist(),
        "mechanism": motions[0].machine.mechanism.name,
        "method": {"name": "joint fit of baseline and named causes", "status": diagnosis.status},
        "collinear": diagnosis.collinear,
        "unrealizable": diagnosis.unrealizable,
        "each_run": {
            label: [
                {"name": one["file"], "sha256": recordings[one["file"]], "values": one["values"]}
                for one in of_runs
            ]
            for label, of_runs in diagnosis.each_run.items()
        },
    }


def _remove_old_figures(output: Path, written: Collection[str]) -> None:
    """Remove the figures of an earlier diagnosis, which would contradict the new verdict."""
    from pipelines.diagnosis.verdict.figures import FIGURES, WITH_DETECTION_LINES

    names = (*FIGURES, WITH_DETECTION_LINES)
    for old in (f"{name}.{kind}" for name in names for kind in ("png", "pdf")):
        if old not in written:
            (output / old).unlink(missing_ok=True)
