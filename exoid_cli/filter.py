"""``exoid filter``: low-pass and differentiate a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import AgainOption, ConfigOption, files_argument, output_option
from exoid_cli.stage_runner import run_stages
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.settings.filter import FilterSettings


def filter_(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        files_argument("recording/1 files.", "recordings/RUN.parquet of every run"),
    ] = None,
    output: Annotated[
        Path | None,
        output_option("The motion/1 file to write, or a folder for several.", "motions/"),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    cutoff_hz: Annotated[
        float | None, typer.Option(min=0.0, help="Cut-off; overrides exoid.toml's.")
    ] = None,
) -> None:
    """Filter recordings' angles without delay and differentiate them; torque stays as measured.

    \b
    Examples:
      exoid filter
      exoid filter run.parquet -o motion.parquet --cutoff-hz 9
    """
    if not files and output is None and cutoff_hz is None:
        folder = open_experiment(config, problem="no recording is given")
        run_stages(context, folder, "filter", again=again)
        return
    settings = settings_in_force(config).filter.changed(cutoff_hz=cutoff_hz)
    targets = _targets(files or [], output, config)
    results = [_filter(file, target, settings) for file, target in targets]
    console.emit(results[0] if len(results) == 1 else results)


def _targets(
    files: list[Path], output: Path | None, config: Path | None
) -> list[tuple[Path, Path]]:
    """Return inputs and outputs, from the experiment unless they are given."""
    if not files:
        folder = open_experiment(config, problem="no recording is given")
        files = [step.inputs[0] for step in folder.of_stage("filter")]
    if output is None:
        output = open_experiment(config, problem="-o: missing").out / "motions"
    # One file may be given a name; several need a folder.
    elif len(files) == 1 and not output.is_dir():
        return [(files[0], output)]
    # Motions keep the names of their recordings, by which later stages match them.
    names = [file.name for file in files]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"two files are named {name}, which {output} can hold only once; filter them one"
                " by one"
            )
    return [(file, output / file.name) for file in files]


def _filter(recording: Path, output: Path, settings: "FilterSettings") -> dict[str, Any]:
    from pipelines.contracts import MOTION, RECORDING, describe
    from pipelines.filtering import Summary, filtered

    with console.working(f"filtering {recording.name}"):
        motion = filtered(RECORDING.scan(recording), settings)
        provenance = describe([recording], {"filter": settings.model_dump(mode="json")})
        summary = Summary(motion)
        MOTION.write_pieces(output, summary.passing(motion.pieces()), motion.metadata | provenance)
    gaps = "no gap" if summary.segments == 1 else f"{summary.segments} segments"
    console.say(
        f"{output}: {summary.samples} samples, {gaps}, {summary.valid_share:.1%} valid, cut-off"
        f" {summary.cutoff_hz:.1f} Hz"
    )
    console.note(summary.why)
    difference = summary.velocity_difference
    return {
        "file": str(output),
        "cutoff_hz": summary.cutoff_hz,
        "why": summary.why,
        "segments": summary.segments,
        "valid_share": summary.valid_share,
        "angle_noise_rad": summary.noise.tolist(),
        "drive_velocity_difference_rad_s": None if difference is None else difference.tolist(),
    }
