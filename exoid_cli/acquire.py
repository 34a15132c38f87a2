"""``exoid acquire``: one run on the rig, recorded."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli import completion
from exoid_cli.background_printer import BackgroundPrinter
from exoid_cli.confirm import ask_before, confirm
from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment
from exoid_cli.options import AgainOption, ConfigOption, YesOption, output_option
from exoid_cli.stage_runner import run_stages
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.acquisition.acquire import Outcome
    from pipelines.acquisition.progress import Progress
    from pipelines.mechanics.trajectory import Trajectory
    from pipelines.settings import Experiment
    from pipelines.settings.rig import RigSettings
    from pipelines.workflow.graph import Step


def acquire(
    context: typer.Context,
    config: ConfigOption = None,
    run: Annotated[
        str | None,
        typer.Option(
            help="Name of the [[run]].",
            show_default="all that are missing or stale",
            autocompletion=completion.runs,
        ),
    ] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="The excitation, Parquet or TOML.",
            show_default="the run's own, or trajectory.parquet",
        ),
    ] = None,
    output: Annotated[
        Path | None, output_option("The recording to write.", "recordings/RUN.parquet")
    ] = None,
    again: AgainOption = False,
    yes: YesOption = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a real rig's recording.")
    ] = False,
    reset_faults: Annotated[
        bool, typer.Option("--reset-faults", help="First clear the faults that drives report.")
    ] = False,
) -> None:
    """Move the leg along an excitation and record every sample.

    Without --run, in an experiment's folder, it records every run that is
    missing or stale, one after another.

    \b
    Examples:
      exoid acquire
      exoid acquire --run with_human_train
      exoid acquire --run with_human_train --trajectory mine.toml -o a.parquet
    """
    from pipelines.settings.rig.recording_only import is_recording_only

    folder = open_experiment(config)
    experiment = folder.experiment
    if run is None:
        if trajectory or output:
            raise InputError("--run: missing; --trajectory and -o are of one run, name it")
        given = {"--overwrite": overwrite, "--reset-faults": reset_faults}
        options = [name for name, is_given in given.items() if is_given]

        def ask(step: "Step") -> list[str]:
            return [*ask_before(experiment, step, yes=yes), *options]

        run_stages(context, folder, "acquire", again=again, before=ask)
        return
    experiment.run_named(run)
    if is_recording_only(experiment.file(experiment.acquire.rig)):
        given = {"--trajectory": trajectory is not None, "--reset-faults": reset_faults}
        for option in (name for name, is_given in given.items() if is_given):
            raise InputError(
                f"{option}: found with a rig file that is recording_only; exoid moves nothing"
                " there, so leave it out"
            )
        _record_only(experiment, run, output or folder.step("acquire", run).target, overwrite)
        return
    if trajectory is None or output is None:
        step = folder.step("acquire", run)
        trajectory, output = trajectory or step.inputs[0], output or step.target
    _record(
        experiment, run, trajectory, output, yes=yes, overwrite=overwrite, reset_faults=reset_faults
    )


def _record_only(experiment: "Experiment", run: str, output: Path, overwrite: bool) -> None:
    """Record a machine that its own controller moves."""
    from pipelines.acquisition.record_only import misread_values, record_only
    from pipelines.workflow.imported import refuse_imported, refuse_recorded

    def claim() -> None:
        if not overwrite:
            refuse_recorded(output)

    refuse_imported(output)
    claim()
    rig = experiment.file(experiment.acquire.rig)
    console.say(f"{rig}: recording only; exoid moves nothing, and writes nothing to any device")

    def report(seconds: float, rows: int) -> None:
        printer.print(f"{seconds:.0f} s, {rows} samples")

    with BackgroundPrinter(console.say) as printer:
        outcome = record_only(
            rig,
            experiment.run_named(run),
            output,
            experiment.acquire.sample_rate_hz,
            experiment.mechanism,
            report,
            claim,
        )
    for warning in misread_values(outcome.path, rig):
        console.warn(warning)
    _say_outcome(outcome, run)


def _say_outcome(outcome: "Outcome", run: str) -> None:
    if outcome.missed:
        console.warn(
            f"{outcome.path}: {outcome.missed} samples were missed; `exoid show` lists the gaps"
        )
    console.emit({key: getattr(outcome, key) for key in ("path", "samples", "missed", "left_out")})
    console.say(f"{outcome.path}: {outcome.samples} samples of run {run}, {outcome.missed} missed")


def _record(
    experiment: "Experiment",
    run: str,
    trajectory: Path,
    output: Path,
    *,
    yes: bool,
    overwrite: bool,
    reset_faults: bool,
) -> None:
    from pipelines.acquisition.acquire import acquire as record
    from pipelines.acquisition.preconditions.human_interlock import unmonitored
    from pipelines.design.lines import cut_periods
    from pipelines.workflow.imported import refuse_imported, refuse_recorded

    def claim() -> None:
        if not overwrite:
            refuse_recorded(output)

    # An imported recording cannot be made again by this command.
    refuse_imported(output)
    # Before any question, and again by `record` once no other run can record there.
    claim()
    experiment.mechanism.refuse_all_but_the_leg("`exoid acquire`")
    settings, rate = experiment.run_named(run), experiment.acquire.sample_rate_hz
    rigs: list[RigSettings] = []
    reports: list[Callable[[Progress], None]] = []
    # Two stacks, since the message of the start ends exactly when the picture of the run begins.
    with ExitStack() as starting, ExitStack() as view:

        def begin(rig: "RigSettings", motion: "Trajectory") -> None:
            for warning in cut_periods([settings], motion):
                console.warn(warning)
            if settings.run == "with_human" and not rig.embedded:
                for warning in unmonitored(rig):
                    console.warn(warning)
                if not yes:
                    confirm(rig, settings, trajectory, motion, rate)
            rigs.append(rig)
            if rig.embedded:
                what = "starting the virtual rig; the first start compiles, up to a minute"
                starting.enter_context(console.starting(what))

        def report(progress: "Progress") -> None:
            # The picture begins with the first progress: a question before it needs the terminal.
            if not reports:
                starting.close()
                reports.append(view.enter_context(_run_view(rigs[0], run)))
            reports[0](progress)

        outcome = record(
            experiment.file(experiment.acquire.rig),
            settings,
            trajectory,
            output,
            rate,
            experiment.mechanism,
            report,
            reset_faults=reset_faults,
            begin=begin,
            claim=claim,
        )
    # Up to as many, they are those of the missed samples.
    if outcome.left_out > outcome.missed:
        console.warn(
            f"{outcome.path}: {outcome.left_out} set-points were left out, since cycles took longer"
            f" than {1e3 / rate:g} ms or answers were lost: the leg moved unevenly there; lower"
            " acquire.sample_rate_hz"
        )
    _say_outcome(outcome, run)


@contextmanager
def _run_view(rig: "RigSettings", run: str) -> Iterator[Callable[["Progress"], None]]:
    """Show a run: a picture on a terminal, else a line every 5 s and at each change of state."""
    # Time between lines of progress where there is no terminal, s.
    line_s = 5.0
    from exoid_cli.operator_view import OperatorView, plain_line

    view, last_line, last_state = OperatorView(rig, run), float("-inf"), None

    def report(progress: "Progress") -> None:
        nonlocal last_line, last_state
        view.update(progress)
        if console.err.is_terminal or not console.speaks:
            return
        # A change of state is shown at once, as it may be a stop.
        if progress.state is not last_state or time.monotonic() - last_line >= line_s:
            last_line, last_state = time.monotonic(), progress.state
            printer.print(plain_line(progress))

    # The run only queues lines; a slow output delays the printer's thread alone.
    with BackgroundPrinter(console.say) as printer, console.live(view):
        yield report
