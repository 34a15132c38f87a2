"""Write an experiment for make: a file for each section of its settings, and the graph's rules.

A section's file that has not changed keeps its time, so that make re-runs only the affected steps.
``graph.mk`` is rewritten each time: its time says when the settings were last read.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pipelines.contracts.atomic import write_text
from pipelines.contracts.provenance import sha256
from pipelines.settings.experiment import Experiment
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.recording_only import is_recording_only
from pipelines.workflow.graph import Step, graph, sealed_file
from pipelines.workflow.imported import with_imported
from pipelines.workflow.investigation import refuse_lost_motion, with_investigation


def split(experiment: Experiment, folder: Path) -> None:
    """Write ``<section>.json``, ``run-<name>.json`` and ``graph.mk`` into a folder."""
    experiment, imported = with_imported(experiment, folder.parent)
    imported.refuse_damaged()
    experiment = with_investigation(experiment, imported, folder.parent)
    refuse_lost_motion(experiment, folder.parent)
    # Variables of make instead of paths, so that the rules hold in any folder.
    steps = graph(experiment, Path("$(CONFIG)"), Path("$(OUT)"), imported)
    sections = experiment.sections(
        "mechanism", "design", "acquire", "filter", "identify", "diagnose", "simulate"
    )
    records = any(step.stage == "acquire" for step in steps)
    if records:
        experiment.refuse_missing_files()
        _add_what_is_recorded(experiment, sections)
    for name, content in sections.items():
        path, text = folder / f"{name}.json", json.dumps(content, indent=1, sort_keys=True) + "\n"
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_text(path, text)
    rules = list(_rules(steps))
    if records and not _may_run_in_parallel(experiment):
        why = "A rig makes one run at a time, and in real time no other step may delay its samples"
        rules += ["", f"# {why}.", ".NOTPARALLEL:"]
    write_text(folder / "graph.mk", "\n".join(rules) + "\n")


def _may_run_in_parallel(experiment: Experiment) -> bool:
    """Return whether other steps may run during a recording, each run on a rig of its own."""
    path = experiment.file(experiment.acquire.rig)
    if is_recording_only(path):
        return False
    rig = load_rig(path)
    # In lockstep no time passes while the computer does something else.
    return rig.embedded and rig.clock == "lockstep"


def _add_what_is_recorded(experiment: Experiment, sections: dict[str, Any]) -> None:
    # A rig or an excitation counts by its content, not by the time of its file.
    rig = experiment.file(experiment.acquire.rig)
    sections["acquire"]["rig_sha256"] = sha256(rig)
    # No stage reads this file, so that the hash of the sealed file reaches no result.
    sealed = sealed_file(rig)
    sections["acquire"]["hidden_sha256"] = sha256(sealed) if sealed else None
    for run in experiment.run:
        section = sections[f"run-{run.name}"] = run.model_dump(mode="json")
        if run.trajectory:
            section["trajectory_sha256"] = sha256(experiment.file(run.trajectory))


def _rules(steps: Sequence[Step]) -> Iterator[str]:
    yield "# Written by `exoid settings split`; changes here are lost."
    yield f"RESULTS := {' '.join(step.target.as_posix() for step in steps)}"
    # A rule without a recipe: make would stop if the sealed file were missing.
    for sealed in dict.fromkeys(step.watched for step in steps if step.watched):
        yield f"$(SETTINGS)/graph.mk: {sealed.as_posix()}"
        yield f"{sealed.as_posix()}:"
    # A phony target is never up to date, nor is a step that needs it.
    yield ".PHONY: incomplete"
    for step in steps:
        yield from _rule(step)


def _rule(step: Step) -> Iterator[str]:
    # An input that is no result, such as a rig, counts by its hash in the settings.
    inputs = [file.as_posix() for file in step.inputs if file.is_relative_to("$(OUT)")]
    # By these files make notices a changed setting.
    names = [f"run-{step.run}" if name == "run" else name for name in step.settings]
    settings = [f"$(SETTINGS)/{name}.json" for name in names]
    yield ""
    yield f"{step.target.as_posix()}: {' '.join([*inputs, *settings, *_if_incomplete(step)])}"
    # make ignores the failure of a step that may fail.
    yield f"\t{'-' * step.may_fail}$(EXOID) {' '.join(step.command)}"
    # With an empty recipe make checks the file's own time after the command.
    yield from (f"{file.as_posix()}: {step.target.as_posix()} ;" for file in step.other_outputs)


def _if_incomplete(step: Step) -> Iterator[str]:
    """Yield the prerequisite of a step that lacks a file; grouped targets would need make 4.3."""
    outputs = " ".join(file.as_posix() for file in step.other_outputs)
    if outputs:
        yield f"$(if $(filter-out $(wildcard {outputs}),{outputs}),incomplete)"
