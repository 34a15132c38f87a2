"""``exoid acquire``: one run on the rig, recorded."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.acquisition.loop import Progress
    from pipelines.settings.rig import RigSettings

LINE_S = 5.0
"""From one line of progress to the next where there is no terminal."""
BAR = 24
CUFFS = ("thigh front", "thigh back", "shank front", "shank back")


def acquire(
    config: Annotated[Path, typer.Option(help="The experiment's exoid.toml.")],
    run: Annotated[str, typer.Option(help="Name of the [[run]] in it.")],
    trajectory: Annotated[Path, typer.Option(help="The excitation, Parquet or TOML.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The recording to write.")],
) -> None:
    """Move the leg along an excitation and record every sample.

    \b
    Example:
      exoid acquire --config exoid.toml --run with_human_train \\
        --trajectory trajectory.parquet -o recordings/with_human_train.parquet
    """
    from pipelines.acquisition.acquire import acquire as record
    from pipelines.settings import Experiment
    from pipelines.settings.rig import load_rig

    experiment = Experiment.load(config)
    settings, rig = experiment.run_named(run), experiment.file(experiment.acquire.rig)
    with _watching(load_rig(rig)) as report:
        outcome = record(
            rig, settings, trajectory, output, experiment.acquire.sample_rate_hz, experiment.mechanism, report
        )
    if outcome.missed:
        console.warn(f"{outcome.path}: {outcome.missed} samples were missed; `exoid show` lists the gaps")
    console.emit({"path": outcome.path, "samples": outcome.samples, "missed": outcome.missed})
    console.say(f"{outcome.path}: {outcome.samples} samples of run {run}, {outcome.missed} missed")


@contextmanager
def _watching(rig: "RigSettings") -> Iterator[Callable[["Progress"], None]]:
    """Show a run as it goes on: a picture on a terminal, else a line now and then."""
    with console.live() as show:
        last_line = float("-inf")

        def report(progress: "Progress") -> None:
            nonlocal last_line
            show(_picture(progress, rig))
            if not console.err.is_terminal and console.speaks and time.monotonic() - last_line >= LINE_S:
                last_line = time.monotonic()
                console.say(_line(progress))

        yield report


def _line(progress: "Progress") -> str:
    head = f"{progress.state:<10} {progress.time_s:7.1f} of {progress.duration_s:.1f} s"
    if progress.row is None:
        return head
    angles = ", ".join(f"{drive.angle:+.3f}" for drive in progress.row.drives)
    torques = ", ".join(f"{drive.torque:+.1f}" for drive in progress.row.drives)
    return f"{head}  angles {angles} rad  torques {torques} N·m  {progress.rate_hz:.0f} Hz  {progress.missed} missed"


def _picture(progress: "Progress", rig: "RigSettings") -> Table:
    """Draw angles, torques and cuff forces as bars between their limits."""
    table = Table.grid(padding=(0, 2))
    table.add_row(progress.state, f"{progress.time_s:.1f} of {progress.duration_s:.1f} s", "", "")
    if progress.row is None:
        return table
    for settings, drive in zip(rig.drive, progress.row.drives, strict=True):
        table.add_row(f"{settings.joint} angle", *_bar(drive.angle, *settings.angle_rad, "rad"))
        table.add_row(f"{settings.joint} torque", *_bar(drive.torque, -settings.torque_nm, settings.torque_nm, "N·m"))
    limit = rig.safety.cuff_force_n
    for cuff, force in zip(CUFFS, progress.row.forces, strict=True):
        largest = max(force, key=abs)
        if largest == largest:  # not NaN: the sensor was read
            table.add_row(f"{cuff} force", *_bar(largest, -limit, limit, "N"))
    table.add_row("rate", f"{progress.rate_hz:.0f} Hz", f"{progress.samples} samples", f"{progress.missed} missed")
    return table


def _bar(value: float, low: float, high: float, unit: str) -> tuple[Text, Text, str]:
    """Return a value, its place between its limits, red near one of them, and the limits."""
    share = min(max((value - low) / (high - low), 0.0), 1.0)
    place = round(share * (BAR - 1))
    style = "red" if not 0.05 < share < 0.95 else "green"
    bar = Text("·" * place + "█" + "·" * (BAR - 1 - place), style=style)
    return Text(f"{value:+.3f} {unit}", style=style), bar, f"{low:g} to {high:g}"
