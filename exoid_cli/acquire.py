"""``exoid acquire``: one run on the rig, recorded."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.aside import Aside
from exoid_cli.confirm import confirm
from exoid_cli.console import console
from exoid_cli.operator_view import OperatorView, plain_line

if TYPE_CHECKING:
    from pipelines.acquisition.loop import Progress
    from pipelines.mechanics.trajectory import Trajectory
    from pipelines.settings.rig import RigSettings

LINE_S = 5.0
"""From one line of progress to the next where there is no terminal."""


def acquire(
    config: Annotated[Path, typer.Option(help="The experiment's exoid.toml.")],
    run: Annotated[str, typer.Option(help="Name of the [[run]] in it.")],
    trajectory: Annotated[Path, typer.Option(help="The excitation, Parquet or TOML.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The recording to write.")],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before a run with somebody in the machine.")] = False,
    reset_faults: Annotated[
        bool, typer.Option("--reset-faults", help="First clear the faults that drives report.")
    ] = False,
) -> None:
    """Move the leg along an excitation and record every sample.

    \b
    Example:
      exoid acquire --config exoid.toml --run with_human_train \\
        --trajectory trajectory.parquet -o recordings/with_human_train.parquet
    """
    from pipelines.acquisition.acquire import acquire as record
    from pipelines.settings import Experiment

    experiment = Experiment.load(config)
    experiment.mechanism.refuse_all_but_the_leg("`exoid acquire`")
    settings, rate = experiment.run_named(run), experiment.acquire.sample_rate_hz
    reports: list[Callable[[Progress], None]] = []
    with ExitStack() as shown:

        def begin(rig: "RigSettings", motion: "Trajectory") -> None:
            if settings.run == "with_human" and not rig.embedded and not yes:
                confirm(rig, settings, trajectory, motion, rate)
            reports.append(shown.enter_context(_watching(rig, run)))

        outcome = record(
            experiment.file(experiment.acquire.rig), settings, trajectory, output, rate, experiment.mechanism,
            lambda progress: reports[0](progress), reset_faults=reset_faults, begin=begin,
        )  # fmt: skip
    if outcome.missed:
        console.warn(f"{outcome.path}: {outcome.missed} samples were missed; `exoid show` lists the gaps")
    console.emit({"path": outcome.path, "samples": outcome.samples, "missed": outcome.missed})
    console.say(f"{outcome.path}: {outcome.samples} samples of run {run}, {outcome.missed} missed")


@contextmanager
def _watching(rig: "RigSettings", run: str) -> Iterator[Callable[["Progress"], None]]:
    """Show a run as it goes on: a picture on a terminal, else a line now and then and at each change of state."""
    view, last_line, last_state = OperatorView(rig, run), float("-inf"), None

    def report(progress: "Progress") -> None:
        nonlocal last_line, last_state
        view.take(progress)
        if console.err.is_terminal or not console.speaks:
            return
        if progress.state is not last_state or time.monotonic() - last_line >= LINE_S:
            last_line, last_state = time.monotonic(), progress.state
            lines.say(plain_line(progress))

    with Aside(console.say) as lines, console.live(view):
        yield report
