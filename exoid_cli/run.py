"""``exoid run``: an experiment brought up to date, without make."""

from collections.abc import Sequence
from functools import partial
from typing import Annotated

import typer

from exoid_cli import completion
from exoid_cli.confirm import YesOption, ask_before
from exoid_cli.console import console
from exoid_cli.place import ConfigOption, OutOption, Place, place_of, why_absent
from exoid_cli.steps import LeftOut, bring_up_to_date


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

    place = place_of(config, out)
    wanted = needed_for(
        place.of_stage(*_known(stages or [], place)) if stages else place.steps, place.steps
    )
    if any(step.stage == "acquire" for step in wanted):
        place.experiment.refuse_what_cannot_run()
    judged = [one for one in Judge(place.out).all(place.steps) if one.step in wanted]
    # What was left out is tried again where it is asked for by name.
    if all(one.state is Freshness.DONE if stages else one.done for one in judged):
        console.emit([])
        console.say("Everything is up to date.")
        return
    # So that make, called next, finds nothing to do.
    split(place.experiment, place.out / ".settings")
    done, left_out = bring_up_to_date(
        context, place, wanted, before=partial(ask_before, place.experiment, yes=yes)
    )
    console.emit([one.as_json() for one in done])
    kept = len(wanted) - len(done) - len(left_out)
    up_to_date = f"; {kept} {'was' if kept == 1 else 'were'} up to date" if kept else ""
    console.say(
        f"\n{len(done)} of {len(wanted)} steps done in {sum(one.seconds for one in done):.0f}"
        f" s{up_to_date}"
    )
    _say_what_is_left_out(left_out)


def _say_what_is_left_out(left_out: Sequence[LeftOut]) -> None:
    """Say once more at the end, where it is read, which steps could not be done, those of one
    reason together."""
    for why in dict.fromkeys(one.why for one in left_out):
        targets = [one.step.target.as_posix() for one in left_out if one.why == why]
        are = "is" if len(targets) == 1 else "are"
        console.say(
            f"{len(targets)} could not be done and {are} left out, {', '.join(targets)}: {why}"
        )


def _known(stages: list[str], place: Place) -> list[str]:
    from pipelines.errors import InputError
    from pipelines.validation.suggestion import suggestion
    from pipelines.workflow.graph import STAGES

    known = list(dict.fromkeys(step.stage for step in place.steps))
    for stage in stages:
        if stage in known:
            continue
        if stage in STAGES:
            raise InputError(f"{stage}: {why_absent(stage)}; leave it out")
        raise InputError(
            f"{stage}: there is no such stage in this experiment; {suggestion(stage, known)}"
        )
    return stages
