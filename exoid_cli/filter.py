"""``exoid filter``: low-pass and differentiate a recording."""

from pathlib import Path
from typing import Annotated

import typer

from exoid_cli.console import console

ConfigOption = Annotated[Path | None, typer.Option("--config", help="exoid.toml; its [filter] section counts.")]


def filter_(
    recording: Annotated[Path, typer.Argument(help="A recording/1 file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The motion/1 file to write.")],
    config: ConfigOption = None,
    cutoff_hz: Annotated[float | None, typer.Option(min=0.0, help="Cut-off; wins over exoid.toml's.")] = None,
) -> None:
    """Filter a recording's angles without delay and differentiate them; torque stays as measured.

    \b
    Example:
      exoid filter recordings/run.parquet -o motions/run.parquet
    """
    from pipelines.contracts import MOTION, RECORDING, describe
    from pipelines.filtering import Summary, filtered
    from pipelines.settings import Experiment
    from pipelines.settings.filter import FilterSettings

    settings = Experiment.load(config).filter if config else FilterSettings()
    if cutoff_hz is not None:
        settings = FilterSettings.model_validate({**settings.model_dump(), "cutoff_hz": cutoff_hz})
    motion = filtered(RECORDING.scan(recording), settings)
    provenance = describe(inputs=[recording], config=settings.model_dump(mode="json"))
    found = Summary(motion)
    MOTION.write_pieces(output, found.passing(motion.pieces()), motion.metadata | provenance)

    report = {
        "file": str(output),
        "cutoff_hz": found.cutoff_hz,
        "why": found.why,
        "segments": found.segments,
        "valid_share": found.valid_share,
        "angle_noise_rad": found.noise.tolist(),
        "drive_velocity_difference_rad_s": (
            None if found.velocity_difference is None else found.velocity_difference.tolist()
        ),
    }
    console.emit(report)
    gaps = "no gap" if found.segments == 1 else f"{found.segments} segments"
    console.say(
        f"{output}: {found.samples} samples, {gaps}, {found.valid_share:.1%} valid; "
        f"cut-off {found.cutoff_hz:.1f} Hz ({found.why})"
    )
