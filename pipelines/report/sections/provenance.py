"""The files behind the page: their hashes, inputs, settings and software versions."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipelines.report.session import Artifact, Session
from pipelines.settings import Experiment

SECTIONS = tuple(name for name in Experiment.model_fields if name not in ("acquire", "run"))
"""Sections of exoid.toml that a stage's file repeats."""
REMEDY = "`exoid run` or `make` makes them again"


def context(session: Session) -> dict[str, Any]:
    """Return the values of the template's list of files, and its warnings."""
    return {
        "warnings": [*_stale(session), *_changed_settings(session)],
        "settings": json.dumps(settings(session), indent=1, ensure_ascii=False),
        "software": _software(session),
        "origins": _origins(session),
        "outside": outside(session),
    }


def _origins(session: Session) -> list[dict[str, Any]]:
    """Return every file of a session with its inputs, oldest first."""
    rows: list[dict[str, Any]] = [
        {
            "file": session.shown(one.path),
            "contract": one.contract,
            "created_by": str(one.metadata.get("created_by") or "unknown"),
            "created_at": str(one.metadata.get("created_at") or ""),
            "sha256": one.sha256,
            "inputs": [stated | {"state": _state(session, stated)} for stated in one.inputs],
        }
        for one in session.artifacts
    ]
    return sorted(rows, key=lambda row: (row["created_at"], row["file"]))


def _state(session: Session, stated: dict[str, str]) -> str:
    """Return ``found``, ``changed`` (the file of that name has other bytes) or ``elsewhere``."""
    if session.file_of(stated["name"], stated["sha256"]):
        return "found"
    # The same name with other bytes: the input was made again after it was used.
    is_here = any(one.path.name == stated["name"] for one in session.artifacts)
    return "changed" if is_here else "elsewhere"


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
            if _state(session, stated) != "elsewhere":
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
        for one in origin["inputs"]:
            if one["state"] == "changed":
                by_file.setdefault(one["name"], []).append(origin["file"])
    return [
        f"{name} has changed since {_few(files)} made of it; {REMEDY}"
        for name, files in by_file.items()
    ]


def _few(files: Sequence[str]) -> str:
    """Return the first three files by name, the number of the others, and their verb."""
    more = [f"{len(files) - 3} more files"] if len(files) > 3 else []
    *most, last = [*files[:3], *more]
    return f"{', '.join(most)} and {last} were" if most else f"{last} was"


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
        f"{_few(files)} made with another [{name}] than {session.config.name} has now; {REMEDY}"
        for name, files in by_value.items()
    ]
