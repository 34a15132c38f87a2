"""The files behind the page: their hashes, inputs, settings and software versions."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipelines.report.sections.section import Content
from pipelines.report.session import Artifact, Session
from pipelines.settings import Experiment

SECTIONS = tuple(name for name in Experiment.model_fields if name not in ("acquire", "run"))
"""Sections of exoid.toml that a stage's file repeats."""
REMEDY = "`exoid run` or `make` makes them again"


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's list of files, and its warnings."""
    session = content.session
    return {
        "warnings": [*_stale(session), *_changed_settings(session)],
        "settings": json.dumps(settings(session), indent=1, ensure_ascii=False),
        "software": _software(session),
        "origins": _origins(session),
        "outside": outside(session),
    }


@dataclass(frozen=True)
class Input:
    """One file that another was computed from."""

    name: str
    sha256: str
    state: str
    """``found`` (the session holds the same bytes), ``changed`` (a file of that name with other
    bytes) or ``elsewhere``."""


@dataclass(frozen=True)
class Origin:
    """One file and its inputs."""

    file: str
    contract: str
    created_by: str
    created_at: str
    sha256: str
    inputs: tuple[Input, ...]

    @property
    def here(self) -> list[str]:
        """Names of the inputs that the session holds and lists with their hashes."""
        return [one.name for one in self.inputs if one.state == "found"]


def _origins(session: Session) -> list[Origin]:
    """Return every file of a session, oldest first."""
    rows = []
    for one in session.artifacts:
        by = str(one.metadata.get("created_by") or "unknown")
        when = str(one.metadata.get("created_at") or "")
        inputs = tuple(_input(session, stated) for stated in one.inputs)
        rows.append(Origin(session.shown(one.path), one.contract, by, when, one.sha256, inputs))
    return sorted(rows, key=lambda origin: (origin.created_at, origin.file))


def _input(session: Session, stated: dict[str, str]) -> Input:
    if session.file_of(stated["name"], stated["sha256"]):
        state = "found"
    # The same name with other bytes: the input was made again after it was used.
    elif any(one.path.name == stated["name"] for one in session.artifacts):
        state = "changed"
    else:
        state = "elsewhere"
    return Input(stated["name"], stated["sha256"], state)


@dataclass(frozen=True)
class Outside:
    """An input of other files that the folders do not hold."""

    name: str
    """Its path if metadata have it, else its file name."""
    role: str
    """Its role, from the metadata of files made of it; empty if unknown."""
    sha256: str
    made_of_it: tuple[str, ...]


def outside(session: Session) -> list[Outside]:
    """Return each input that the folders lack, with the files made of it."""
    results: dict[str, Outside] = {}
    for one in session.artifacts:
        for stated in one.inputs:
            if _input(session, stated).state != "elsewhere":
                continue
            name, role = _role(one, stated["name"])
            digest = stated["sha256"]
            before = results.get(digest, Outside(name, role, digest, ()))
            files = (*before.made_of_it, session.shown(one.path))
            # By its bytes: two logs of one name in different folders are two inputs.
            results[digest] = replace(before, made_of_it=files)
    return list(results.values())


def _role(artifact: Artifact, name: str) -> tuple[str, str]:
    """Return name or path, and role, of an input of a file."""
    imported = artifact.metadata.get("imported")
    if isinstance(imported, dict):
        key, role = ("map", "the log's map") if name.endswith(".toml") else ("source", "a log")
        given = (imported.get("given") or {}).get(key, name)
        return (given if Path(given).name == name else name), role
    config = artifact.metadata.get("config") or {}
    if artifact.kind == "recording" and "rig" in config and name.endswith(".toml"):
        return name, "the rig's file"
    return name, ""


def _stale(session: Session) -> list[str]:
    """Return a sentence for each file that changed after other files were made of it."""
    by_file: dict[str, list[str]] = {}
    for origin in _origins(session):
        for one in origin.inputs:
            if one.state == "changed":
                by_file.setdefault(one.name, []).append(origin.file)
    return [
        f"{name} has changed since {_few(files)} {'was' if len(files) == 1 else 'were'} made of it;"
        f" {REMEDY}"
        for name, files in by_file.items()
    ]


def _few(files: Sequence[str]) -> str:
    """Return the first files by name, and the number of the others."""
    # Number of files that a warning names.
    few = 3
    more = [f"{len(files) - few} more files"] if len(files) > few else []
    *most, last = [*files[:few], *more]
    return f"{', '.join(most)} and {last}" if most else last


def _software(session: Session) -> list[tuple[str, list[str]]]:
    """Return each set of software versions in words, with the files that were made with it."""
    versions: dict[str, list[str]] = {}
    for one in session.artifacts:
        stated = one.metadata.get("software")
        if isinstance(stated, dict) and stated:
            names = {"python": "Python"}
            words = ", ".join(f"{names.get(name, name)} {stated[name]}" for name in stated)
            versions.setdefault(words, []).append(session.shown(one.path))
    return list(versions.items())


def settings(session: Session) -> dict[str, dict[str, Any]]:
    """Return the resolved settings with which the files were made, by section."""
    values: dict[str, dict[str, Any]] = {}
    for artifact in session.artifacts:
        values |= resolved(artifact)
    return {name: values[name] for name in SECTIONS if name in values}


def resolved(artifact: Artifact) -> dict[str, dict[str, Any]]:
    """Return the sections of settings in one file's ``config``, by name."""
    config = artifact.metadata.get("config") or {}
    return {name: config[name] for name in SECTIONS if isinstance(config.get(name), dict)}


def _changed_settings(session: Session) -> list[str]:
    """Return a sentence for each section of exoid.toml that has changed since files were made."""
    now = session.experiment
    if session.config is None or now is None:
        return []
    by_value: dict[str, list[str]] = {}
    for one in session.artifacts:
        for name, setting in resolved(one).items():
            is_now = getattr(now, name).model_dump(mode="json")
            # A key that a file lacks is of a newer exoid and does not count as a change.
            if any(setting[key] != value for key, value in is_now.items() if key in setting):
                by_value.setdefault(name, []).append(session.shown(one.path))
    return [
        f"{_few(files)} {'was' if len(files) == 1 else 'were'} made with another [{name}] than"
        f" {session.config.name} has now; {REMEDY}"
        for name, files in by_value.items()
    ]
