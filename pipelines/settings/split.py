"""An experiment cut into one small file a section, so that make re-runs only what a change touches.

A file whose content is already right keeps its time. ``graph.mk`` is rewritten each time: it tells make the runs, and
its time says when the settings were last looked at.
"""

import json
from pathlib import Path
from typing import Any

from pipelines.contracts.atomic import write_text
from pipelines.contracts.provenance import sha256
from pipelines.errors import SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.experiment import Experiment
from pipelines.settings.rig import load_rig

SECTIONS = ("mechanism", "design", "acquire", "filter", "identify", "simulate")


def split(experiment: Experiment, folder: Path) -> None:
    """Write ``<section>.json``, ``run-<name>.json`` and ``graph.mk`` into a folder."""
    sections: dict[str, Any] = {name: getattr(experiment, name).model_dump(mode="json") for name in SECTIONS}
    # A rig or an excitation is a setting too: its content counts, not the time of its file.
    sections["acquire"]["rig_sha256"] = _digest(experiment, "acquire.rig", experiment.acquire.rig)
    # No stage reads this file, it only has a time for make: what the rig keeps sealed goes no further than its hash.
    sealed = _sealed(experiment)
    sections["acquire"]["hidden_sha256"] = sha256(sealed) if sealed else None
    for run in experiment.run:
        section = sections[f"run-{run.name}"] = run.model_dump(mode="json")
        if run.trajectory:
            section["trajectory_sha256"] = _digest(experiment, f"run {run.name}.trajectory", run.trajectory)
    for name, content in sections.items():
        _write_if_changed(folder / f"{name}.json", json.dumps(content, indent=1, sort_keys=True) + "\n")
    write_text(folder / "graph.mk", _graph(experiment))


def _digest(experiment: Experiment, key: str, name: str) -> str:
    path = experiment.file(name)
    if not path.is_file():
        raise SettingsError(f"{key}: {path}: no such file; name one relative to the experiment's file")
    return sha256(path)


def _sealed(experiment: Experiment) -> Path | None:
    """Return the file of what the rig hides, where there is one; a rig that lacks it says so when it is started."""
    path = experiment.file(experiment.acquire.rig)
    plant = load_rig(path).plant
    sealed = path.parent / plant.sealed if plant and plant.sealed else None
    return sealed if sealed and sealed.is_file() else None


def _write_if_changed(path: Path, text: str) -> None:
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text(path, text)


def _graph(experiment: Experiment) -> str:
    validate = " ".join(run.name for run in experiment.run if run.purpose == "validate")
    lines = [
        "# Written by `exoid settings split`; changes here are lost.",
        f"RUNS := {' '.join(run.name for run in experiment.run)}",
        f"VALIDATE_RUNS := {validate}",
        *_looked_at(experiment),
        *(_recording_rule(experiment, run) for run in experiment.run),
    ]
    return "\n".join(lines) + "\n"


def _looked_at(experiment: Experiment) -> list[str]:
    """Return rules by which the settings are split anew where the sealed file has changed."""
    sealed = _sealed(experiment)
    # Its own rule, without a recipe, keeps make from giving up where the file is gone.
    return [f"$(SETTINGS)/graph.mk: {sealed}", f"{sealed}:"] if sealed else []


def _recording_rule(experiment: Experiment, run: RunSettings) -> str:
    own = experiment.file(run.trajectory) if run.trajectory else "$(OUT)/trajectory.parquet"
    target = f"$(OUT)/recordings/{run.name}.parquet"
    # The run's own excitation counts by its hash, in run-<name>.json; the designed one is a target of make.
    prerequisites = f"$(SETTINGS)/run-{run.name}.json" + ("" if run.trajectory else f" {own}")
    return f"{target}: {prerequisites}\n{target}: TRAJECTORY := {own}"
