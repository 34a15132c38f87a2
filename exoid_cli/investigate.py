"""``exoid investigate``: record further experiments until a verdict is sure."""

import shutil
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from exoid_cli.confirm import ask_before
from exoid_cli.console import console
from exoid_cli.experiment_folder import ExperimentFolder, open_experiment, why_no_step
from exoid_cli.next_ import compare_experiments, show_experiments, write_motion
from exoid_cli.options import ConfigOption, OutOption, YesOption
from exoid_cli.stage_runner import bring_up_to_date
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.investigation.doubt import Doubt


def investigate(
    context: typer.Context,
    config: ConfigOption = None,
    out: OutOption = None,
    yes: YesOption = False,
) -> None:
    """Record further experiments until the causes of a verdict are decided.

    It brings the diagnosis up to date, designs the motion that decides best between
    the causes left open, records every run along it, and diagnoses all recordings
    together; again, until one cause has 0.95, the budget in [investigate] is spent,
    or no motion can help. Started again, it goes on where it was stopped.

    \b
    Examples:
      exoid investigate
      exoid investigate --config my_experiment/exoid.toml --yes
    """
    from pipelines.workflow.graph import needed_for
    from pipelines.workflow.investigation import last_step, refuse_lost_verdicts
    from pipelines.workflow.split import split

    folder = open_experiment(config, out)
    _refuse_without_rig(folder)
    refuse_lost_verdicts(folder.out)
    while True:
        # First, so that make, called next, finds every result newer than its settings.
        split(folder.experiment, folder.out / ".settings")
        _refuse_to_record_again(folder)
        wanted = needed_for([folder.step("diagnose")], folder.steps)
        bring_up_to_date(
            context, folder, wanted, before=partial(ask_before, folder.experiment, yes=yes)
        )
        doubt = _doubt(folder)
        why = _why_to_stop(folder, doubt) or _add_step(folder, last_step(folder.out) + 1)
        if why:
            break
        folder = open_experiment(config, out)
    _show(folder, doubt, why)


def _refuse_without_rig(folder: ExperimentFolder) -> None:
    from pipelines.settings.rig.recording_only import is_recording_only

    folder.experiment.mechanism.refuse_all_but_the_leg("`exoid investigate`")
    instead = "`exoid next` says which motion would decide"
    if not folder.of_stage("acquire"):
        raise InputError(
            f"{folder.experiment.path}: all its recordings were imported, and `exoid investigate`"
            f" records on a rig; {instead}"
        )
    if not folder.of_stage("diagnose"):
        raise InputError(f"{folder.experiment.path}: {why_no_step('diagnose')}; add one")
    folder.experiment.refuse_what_cannot_run()
    rig = folder.experiment.file(folder.experiment.acquire.rig)
    if is_recording_only(rig):
        raise InputError(f"{rig}: is recording_only, so exoid moves nothing by it; {instead}")


def _refuse_to_record_again(folder: ExperimentFolder) -> None:
    """Refuse where a real rig's recording is stale, before the motion it followed is replaced."""
    from pipelines.workflow.freshness import Freshness, Judge
    from pipelines.workflow.imported import real_rig_of

    changed: tuple[str, ...] = ()
    for judged in Judge(folder.out).all(folder.steps):
        if judged.step.stage == "design" and not judged.done:
            changed = judged.why or (f"{judged.step.target} is missing",)
        if judged.step.stage != "acquire" or judged.state is not Freshness.STALE:
            continue
        rig = real_rig_of(judged.step.target)
        if rig is not None:
            reason = (changed or judged.why)[0]
            raise InputError(
                f"{judged.step.target}: is a recording of the rig {rig}, and nothing records it"
                f" again ({reason}); undo that change, or begin again with --out DIR"
            )


def _doubt(folder: ExperimentFolder) -> "Doubt":
    from pipelines.contracts.verdict import read
    from pipelines.investigation.doubt import doubt_of

    return doubt_of(read(folder.step("diagnose").target))


def _why_to_stop(folder: ExperimentFolder, doubt: "Doubt") -> str | None:
    """Return why no further experiment is made; None where one would help and is affordable."""
    from pipelines.investigation.doubt import State
    from pipelines.workflow.investigation import repeated_runs

    if doubt.state in (State.NAMED, State.NOTHING):
        return "nothing is left open"
    if doubt.state is not State.OPEN:
        return "no motion can help"
    further = [run for run in folder.experiment.run if run.step]
    further += repeated_runs(folder.experiment, folder.imported)
    budget = folder.experiment.investigate
    minutes = sum(run.duration_s for run in further) / 60.0
    if len(further) > budget.runs:
        return (
            f"another step would make {len(further)} further runs, investigate.runs is"
            f" {budget.runs}"
        )
    if minutes > budget.minutes:
        return (
            f"another step would make {minutes:.3g} further minutes, investigate.minutes is"
            f" {budget.minutes:g}"
        )
    return None


def _add_step(folder: ExperimentFolder, step: int) -> str | None:
    """Design a step's motion and write its folder, or return why no motion helps."""
    from pipelines.contracts.atomic import all_or_none, folder_to_fill
    from pipelines.workflow.investigation import motion_of, step_folder, verdict_before

    diagnosed = folder.step("diagnose").target
    console.say(f"\nStep {step}:")
    result = compare_experiments(diagnosed.parent, folder.experiment, folder.experiment.path)
    show_experiments(result)
    if result.design is None:
        return "no motion within [design.bounds] separates the causes"
    decides, least = result.design.separation.decides(), folder.experiment.investigate
    if decides < least.least_probability:
        return (
            f"the best motion decides with probability {decides:.2g}, and"
            f" investigate.least_probability is {least.least_probability:g}"
        )
    # The motion last: a folder with one is a step.
    new_folder, motion = step_folder(folder.out, step), motion_of(folder.out, step)
    if motion.exists():
        raise InputError(
            f"{motion}: was written in the meantime by another `exoid investigate`, and is not"
            " overwritten; let that one end"
        )
    with folder_to_fill(new_folder), all_or_none(new_folder, last=motion.name) as new:
        shutil.copyfile(diagnosed, new / verdict_before(folder.out, step).name)
        write_motion(new / motion.name, result.design, folder.experiment)
    console.say(f"\n{motion}: every run is recorded along it.\n")
    return None


def _show(folder: ExperimentFolder, doubt: "Doubt", why: str) -> None:
    from pipelines.wording.investigation import history

    steps = history(folder.out, folder.step("diagnose").target)
    labels = list(dict.fromkeys(label for one in steps for label in one.probabilities))
    document: dict[str, Any] = {"state": doubt.state.value, "words": doubt.words, "stopped_by": why}
    console.emit(document | {"steps": [one.as_json() for one in steps]})
    console.say("")
    headings = ("step", "runs", "expected to decide", *labels)
    rows = [
        (
            str(one.step),
            str(one.runs),
            "" if one.decides is None else f"{one.decides:.0%}",
            *(f"{one.probabilities.get(label, 0.0):.2f}" for label in labels),
        )
        for one in steps
    ]
    console.table(headings, rows, numbers=", ".join(headings))
    words = doubt.words[:1].upper() + doubt.words[1:]
    console.say(f"\n{words}. Stopped: {why}.")
