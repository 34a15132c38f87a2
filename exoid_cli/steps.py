"""Steps of an experiment, done by the same commands that a user would call, in this process."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.place import Place
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.workflow.freshness import Judged
    from pipelines.workflow.graph import Step

AgainOption = Annotated[bool, typer.Option("--again", help="Make anew what is up to date, too.")]

Before = Callable[["Step"], Sequence[str]]
"""Called before a step; returns what its command is to be told besides."""


@dataclass(frozen=True)
class Done:
    """A step that was done."""

    step: "Step"
    seconds: float
    result: Any
    """What the command would have printed with ``--json``."""

    def as_json(self) -> dict[str, Any]:
        """Return it for programs."""
        return {
            "stage": self.step.stage,
            "target": self.step.target,
            "command": ["exoid", *self.step.command],
            "seconds": round(self.seconds, 3),
            "result": self.result,
        }


@dataclass(frozen=True)
class LeftOut:
    """A step that could not be done, though it may be that what needs it does without."""

    step: "Step"
    why: str


def bring_up_to_date(
    context: typer.Context,
    place: Place,
    wanted: "Sequence[Step]",
    *,
    again: bool = False,
    before: Before = lambda step: (),
) -> tuple[list[Done], list[LeftOut]]:
    """Do the wanted steps that are not done, or all ``again``, each after those before it; return
    what became of them.

    All steps of the experiment are judged, for a step is stale where one it needs is.
    """
    from pipelines.workflow.freshness import Judge

    judge, done, left_out = Judge(place.out), list[Done](), list[LeftOut]()
    for step in place.steps:
        judged = judge.judge(step)
        if step in wanted and (again or not judged.done):
            if done:
                console.say("")
            try:
                done.append(_perform(context, judged, before(step)))
            except InputError as error:
                if not step.may_fail:
                    raise
                left_out.append(LeftOut(step, str(error)))
                console.warn(f"{error}; {step.target.as_posix()} is left out")
            judge.judge(step)
    return done, left_out


def only(
    context: typer.Context,
    place: Place,
    *stages: str,
    again: bool = False,
    before: Before = lambda step: (),
) -> None:
    """Do what a command does that was told nothing: bring the steps of its own stages up to date,
    and no others."""
    wanted = place.of_stage(*stages) or [place.step(stages[0])]  # which says why there is none
    _look_before(place, wanted)
    done, left_out = bring_up_to_date(context, place, wanted, again=again, before=before)
    console.emit([one.as_json() for one in done])
    tried = [one.step for one in done] + [one.step for one in left_out]
    for step in wanted:
        if step not in tried:
            console.say(f"{step.target.as_posix()}: up to date; --again makes it anew")


def _look_before(place: Place, wanted: "Sequence[Step]") -> None:
    """Refuse where an input is missing that another stage makes; warn where one is stale."""
    from pipelines.workflow.freshness import Freshness, Judge

    makers = {file: one for one in Judge(place.out).all(place.steps) for file in one.step.makes}
    told = set[str]()
    for step in wanted:
        for maker in (makers[file] for file in step.inputs if file in makers):
            stage = maker.step.stage
            if maker.state is Freshness.MISSING:
                raise InputError(
                    f"{maker.step.target}: no such file yet; `exoid {stage}` makes it, "
                    f"`exoid run {step.stage}` makes all that is needed"
                )
            if not maker.done and stage not in told:
                told.add(stage)
                console.warn(
                    f"{stage} is stale: {maker.why[0]}; `exoid run {step.stage}` brings it up to"
                    " date too"
                )


def _perform(context: typer.Context, judged: "Judged", told: Sequence[str]) -> Done:
    """Call the step's command, after a line that says how it would be called and why."""
    name, *arguments = (*judged.step.command, *told)
    console.say_command(["exoid", name, *arguments], "; ".join(judged.why[:1]))
    began = time.monotonic()
    root = context.find_root()
    # The root is a group of commands, which click declares as any command.
    command = root.command.get_command(root, name)  # type: ignore[attr-defined]
    with (
        console.gathering() as results,
        command.make_context(name, list(arguments), parent=root) as inner,
    ):
        inner.command.invoke(inner)
    return Done(judged.step, time.monotonic() - began, results[0] if results else None)
