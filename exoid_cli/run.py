"""``exoid run``: bring an experiment up to date, without make."""

from collections.abc import Sequence
from functools import partial
from typing import Annotated

import typer

from exoid_cli import completion
from exoid_cli.confirm import ask_before
from exoid_cli.console import console
from exoid_cli.experiment_folder import ExperimentFolder, open_experiment, why_no_step
from exoid_cli.options import ConfigOption, OutOption, YesOption
from exoid_cli.stage_runner import bring_up_to_date


def run(
    context: typer.Context,
    stages: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="STAGE",
            help="Stages wanted, with all they need.",
            show_default="all",
            autocompletion=completion.stages,
        ),
    ] = None,
    config: ConfigOption = None,
    out: OutOption = None,
    yes: YesOption = False,
) -> None:
    """Do every step of an experiment that is missing or stale, as make does.

    \b
    Examples:
      exoid run
      exoid run identify
      exoid run --config my_experiment/exoid.toml
    """
    from pipelines.workflow.freshness import Freshness, Judge
    from pipelines.workflow.graph import needed_for
    from pipelines.workflow.split import split

    folder = open_experiment(config, out)
    _refuse_unknown(stages or [], folder)
    # With a named stage, the steps that it needs, too; others may stay stale.
    wanted = needed_for(folder.of_stage(*stages) if stages else folder.steps, folder.steps)
    # Before the first step: a rig that cannot run would else stop the work in its middle.
    if any(step.stage == "acquire" for step in wanted):
        folder.experiment.refuse_what_cannot_run()
    judged = [one for one in Judge(folder.out).all(folder.steps) if one.step in wanted]
    # A step that was left out is tried again if its stage is named.
    if all(one.state is Freshness.DONE if stages else one.done for one in judged):
        console.emit([])
        console.say("Everything is up to date.")
        return
    # So that make, called next, has nothing to do.
    split(folder.experiment, folder.out / ".settings")
    results, skipped = bring_up_to_date(
        context, folder, wanted, before=partial(ask_before, folder.experiment, yes=yes)
    )
    console.emit(results)
    fresh = len(wanted) - len(results) - len(skipped)
    up_to_date = f"; {fresh} {'was' if fresh == 1 else 'were'} up to date" if fresh else ""
    console.say(
        f"\n{len(results)} of {len(wanted)} steps done in"
        f" {sum(result['seconds'] for result in results):.0f} s{up_to_date}"
    )
    # Repeated at the end, those of one reason together.
    for reason in dict.fromkeys(reason for _, reason in skipped):
        targets = [step.target.as_posix() for step, why in skipped if why == reason]
        console.say(f"not done, so left out: {', '.join(targets)}: {reason}")


def _refuse_unknown(stages: Sequence[str], folder: ExperimentFolder) -> None:
    from pipelines.errors import InputError
    from pipelines.validation.suggestion import suggestion
    from pipelines.workflow.graph import STAGES

    known = list(dict.fromkeys(step.stage for step in folder.steps))
    for stage in (stage for stage in stages if stage not in known):
        if stage in STAGES:
            raise InputError(f"{stage}: {why_no_step(stage)}; leave it out")
        raise InputError(
            f"{stage}: there is no such stage in this experiment; {suggestion(stage, known)}"
        )
