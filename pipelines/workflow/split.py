"""An experiment told to make: one small file a section of its settings, and the rules of its graph.

A section's file whose content is already right keeps its time, so that make re-runs only what a
change touches. ``graph.mk`` is rewritten each time: its time says when the settings were last
looked at.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pipelines.contracts.atomic import write_text
from pipelines.contracts.provenance import sha256
from pipelines.settings.experiment import Experiment
from pipelines.workflow.graph import Step, graph, sealed_file
from pipelines.workflow.imported import with_imported

INCOMPLETE = "incomplete"
"""What make is told that a step needs of whose files one is missing."""


def split(experiment: Experiment, folder: Path) -> None:
    """Write ``<section>.json``, ``run-<name>.json`` and ``graph.mk`` into a folder."""
    experiment, imported = with_imported(experiment, folder.parent)
    imported.refuse_damaged()
    # Names that make knows stand for the places, so that the rules hold wherever make is told to
    # work.
    steps = graph(experiment, Path("$(CONFIG)"), Path("$(OUT)"), imported)
    sections = experiment.sections(
        "mechanism", "design", "acquire", "filter", "identify", "diagnose", "simulate"
    )
    if any(step.stage == "acquire" for step in steps):
        experiment.refuse_missing_files()
        _add_what_is_recorded(experiment, sections)
    for name, content in sections.items():
        _write_if_changed(
            folder / f"{name}.json", json.dumps(content, indent=1, sort_keys=True) + "\n"
        )
    write_text(folder / "graph.mk", "\n".join(_rules(steps)) + "\n")


def _add_what_is_recorded(experiment: Experiment, sections: dict[str, Any]) -> None:
    # A rig or an excitation is a setting too: its content counts, not the time of its file.
    rig = experiment.file(experiment.acquire.rig)
    sections["acquire"]["rig_sha256"] = sha256(rig)
    # No stage reads this file, it only has a time for make: what the rig keeps sealed goes no
    # further than its hash.
    sealed = sealed_file(rig)
    sections["acquire"]["hidden_sha256"] = sha256(sealed) if sealed else None
    for run in experiment.run:
        section = sections[f"run-{run.name}"] = run.model_dump(mode="json")
        if run.trajectory:
            section["trajectory_sha256"] = sha256(experiment.file(run.trajectory))


def _write_if_changed(path: Path, text: str) -> None:
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text(path, text)


def _rules(steps: Sequence[Step]) -> Iterator[str]:
    yield "# Written by `exoid settings split`; changes here are lost."
    yield f"RESULTS := {' '.join(step.target.as_posix() for step in steps)}"
    # Its own rule, without a recipe, keeps make from giving up where the sealed file is gone.
    for sealed in dict.fromkeys(step.watched for step in steps if step.watched):
        yield f"$(SETTINGS)/graph.mk: {sealed.as_posix()}"
        yield f"{sealed.as_posix()}:"
    # What is phony is never up to date, nor is a step then that needs it.
    yield f".PHONY: {INCOMPLETE}"
    for step in steps:
        yield from _rule(step)


def _rule(step: Step) -> Iterator[str]:
    # What is no result, such as a rig, counts by its hash in the settings.
    made = [file.as_posix() for file in step.inputs if file.is_relative_to("$(OUT)")]
    settings = [f"$(SETTINGS)/{name}.json" for name in step.settings_files]
    yield ""
    yield f"{step.target.as_posix()}: {' '.join([*made, *settings, *_if_incomplete(step)])}"
    # A step that may be impossible is tried, and what needs it made without it.
    yield f"\t{'-' * step.may_fail}$(EXOID) {' '.join(step.command)}"
    # With an empty recipe make looks at the file's own time, once the command has run.
    yield from (f"{file.as_posix()}: {step.target.as_posix()} ;" for file in step.beside)


def _if_incomplete(step: Step) -> Iterator[str]:
    """Yield what a step needs that is to be done again for a missing file; rules of several files
    need make 4.3."""
    beside = " ".join(file.as_posix() for file in step.beside)
    if beside:
        yield f"$(if $(filter-out $(wildcard {beside}),{beside}),{INCOMPLETE})"
