"""``exoid filter``: low-pass and differentiate a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.place import ConfigOption, place_of, settings_in_force
from exoid_cli.steps import AgainOption, only
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.settings.filter import FilterSettings


def filter_(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE",
            help="recording/1 files.",
            show_default="recordings/RUN.parquet of every run",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="The motion/1 file to write, or a folder for several.",
            show_default="motions/",
        ),
    ] = None,
    config: ConfigOption = None,
    again: AgainOption = False,
    cutoff_hz: Annotated[
        float | None, typer.Option(min=0.0, help="Cut-off; wins over exoid.toml's.")
    ] = None,
) -> None:
    """Filter recordings' angles without delay and differentiate them; torque stays as measured.

    \b
    Examples:
      exoid filter
      exoid filter run.parquet -o motion.parquet --cutoff-hz 9
    """
    if not files and output is None and cutoff_hz is None:
        only(context, place_of(config, lacking="no recording is given"), "filter", again=again)
        return
    settings = settings_in_force(config).filter.changed(cutoff_hz=cutoff_hz)
    made = [
        _filter(file, target, settings) for file, target in _targets(files or [], output, config)
    ]
    console.emit(made[0] if len(made) == 1 else made)


def _targets(
    files: list[Path], output: Path | None, config: Path | None
) -> list[tuple[Path, Path]]:
    """Return what to read and what to write, from the experiment where they are not told."""
    if not files:
        files = [
            step.inputs[0]
            for step in place_of(config, lacking="no recording is given").of_stage("filter")
        ]
    if output is None:
        output = place_of(config, lacking="-o: missing").out / "motions"
    elif len(files) == 1 and not output.is_dir():
        return [(files[0], output)]
    names = [file.name for file in files]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"found two files named {name}, which would be one in {output}; filter them one"
                " by one"
            )
    return [(file, output / file.name) for file in files]


def _filter(recording: Path, output: Path, settings: "FilterSettings") -> dict[str, Any]:
    from pipelines.contracts import MOTION, RECORDING, describe
    from pipelines.filtering import Summary, filtered

    with console.working(f"filtering {recording.name}"):
        motion = filtered(RECORDING.scan(recording), settings)
        provenance = describe(
            inputs=[recording], config={"filter": settings.model_dump(mode="json")}
        )
        found = Summary(motion)
        MOTION.write_pieces(output, found.passing(motion.pieces()), motion.metadata | provenance)
    gaps = "no gap" if found.segments == 1 else f"{found.segments} segments"
    console.say(
        f"{output}: {found.samples} samples, {gaps}, {found.valid_share:.1%} valid, cut-off"
        f" {found.cutoff_hz:.1f} Hz"
    )
    console.note(found.why)
    difference = found.velocity_difference
    return {
        "file": str(output),
        "cutoff_hz": found.cutoff_hz,
        "why": found.why,
        "segments": found.segments,
        "valid_share": found.valid_share,
        "angle_noise_rad": found.noise.tolist(),
        "drive_velocity_difference_rad_s": None if difference is None else difference.tolist(),
    }
