"""Run the steps of an experiment by the same commands that a user types, in this process."""

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import ExperimentFolder
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.workflow.freshness import JudgedStep
    from pipelines.workflow.graph import Step

Before = Callable[["Step"], Sequence[str]]
"""Called before a step; returns further arguments for its command."""


def bring_up_to_date(
    context: typer.Context,
    folder: ExperimentFolder,
    wanted: "Sequence[Step]",
    *,
    again: bool = False,
    before: Before = lambda step: (),
) -> "tuple[list[dict[str, Any]], list[tuple[Step, str]]]":
    """Run the wanted steps that are not up to date, or all of them if ``again``, in order.

    Every step of the experiment is judged, because a step is stale where one it needs is. Return
    the steps that were run, for programs, and those that failed, which later steps can do without,
    with the reason.
    """
    from pipelines.workflow.freshness import Judge

    judge = Judge(folder.out)
    results: list[dict[str, Any]] = []
    skipped: list[tuple[Step, str]] = []
    for step in folder.steps:
        judged = judge.judge(step)
        if step not in wanted or (judged.done and not again):
            continue
        if results:
            console.say("")
        try:
            results.append(_run(context, judged, before(step)))
        except InputError as error:
            if not step.may_fail:
                raise
            skipped.append((step, str(error)))
            console.warn(f"{error}; {step.target.as_posix()} is left out")
        # Judged again, so that steps that need its result see its new state.
        judge.judge(step)
    return results, skipped


def run_stages(
    context: typer.Context,
    folder: ExperimentFolder,
    *stages: str,
    again: bool = False,
    before: Before = lambda step: (),
) -> None:
    """Bring a command's own stages up to date, and no others."""
    # Without a step of the first stage, `step` raises the error that explains it.
    wanted = folder.of_stage(*stages) or [folder.step(stages[0])]
    _check_inputs(folder, wanted)
    results, skipped = bring_up_to_date(context, folder, wanted, again=again, before=before)
    console.emit(results)
    tried = {result["target"] for result in results} | {step.target for step, _ in skipped}
    for step in wanted:
        if step.target not in tried:
            console.say(f"{step.target.as_posix()}: up to date; --again makes it again")


def _check_inputs(folder: ExperimentFolder, wanted: "Sequence[Step]") -> None:
    """Refuse a missing input that another stage makes; warn of a stale one."""
    from pipelines.workflow.freshness import Freshness, Judge

    judged = Judge(folder.out).all(folder.steps)
    makers = {file: maker for maker in judged for file in maker.step.makes}
    warned = set[str]()
    for step in wanted:
        for maker in (makers[file] for file in step.inputs if file in makers):
            stage = maker.step.stage
            if maker.state is Freshness.MISSING:
                raise InputError(
                    f"{maker.step.target}: no such file yet; `exoid {stage}` makes it, "
                    f"`exoid run {step.stage}` makes all that is needed"
                )
            if not maker.done and stage not in warned:
                warned.add(stage)
                console.warn(
                    f"{stage} is stale: {maker.why[0]}; `exoid run {step.stage}` brings it up to"
                    " date too"
                )


def _run(context: typer.Context, judged: "JudgedStep", more: Sequence[str]) -> dict[str, Any]:
    """Print a step's command line and its reason, then run the command; return it for programs."""
    name, *arguments = (*judged.step.command, *more)
    console.say_command(["exoid", name, *arguments], "; ".join(judged.why[:1]))
    began = time.monotonic()
    root = context.find_root()
    # The root is a group of commands, which click declares as any command.
    command = root.command.get_command(root, name)  # type: ignore[attr-defined]
    with (
        # The inner command's document becomes a part of this one's.
        console.gathering() as documents,
        command.make_context(name, list(arguments), parent=root) as inner,
    ):
        inner.command.invoke(inner)
    return {
        "stage": judged.step.stage,
        "target": judged.step.target,
        "command": ["exoid", *judged.step.command],
        "seconds": round(time.monotonic() - began, 3),
        # The document that the command prints with --json.
        "result": documents[0] if documents else None,
    }
