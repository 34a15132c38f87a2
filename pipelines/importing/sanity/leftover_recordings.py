"""What stands in the folder after an import: what an earlier one left, and what a verdict still
lacks."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipelines.contracts.joints import in_words, joints_of
from pipelines.mechanics.machine import mechanisms_of
from pipelines.settings.import_map import ImportMap

NEEDED = {"train": "to fit to", "validate": "to judge on"}


Metadata = Mapping[str, Mapping[str, Any]]
"""That of the imported recordings in a folder, by their names (``imported_in``)."""


def no_longer_made(found: Metadata, made: Collection[str]) -> list[str]:
    """Return the files found that were made of the same logs as ``made`` were, by a map that named
    them so."""
    logs = {sha for name in made for sha in found[name]["imported"]["sha256"]}
    return [
        f"{name}.parquet"
        for name, told in found.items()
        if name not in made and not logs.isdisjoint(told["imported"]["sha256"])
    ]


def unused(settings: ImportMap, files: Collection[Path]) -> Iterator[str]:
    """Yield which recordings of a map are of none of the files."""
    for number, recording in enumerate(settings.recording):
        if not any(map(recording.is_of, files)):
            yield (
                f'recording[{number}] ({recording.purpose}) is of "{recording.files}", and no file'
                " given is; left out"
            )


def lacks(found: Metadata, made: Collection[str], map_path: Path) -> Iterator[str]:
    """Yield what keeps the recordings in a folder from a verdict."""
    purposes = {told["purpose"] for told in found.values()}
    for purpose, what in NEEDED.items():
        if purpose not in purposes:
            yield (
                f"`exoid run` lacks a recording {what}: add a [[recording]] to {map_path} with "
                f'purpose = "{purpose}", and a span of its own or the files that it is of'
            )
    yield from dict.fromkeys(filter(None, (_unknown_mechanism(found[name]) for name in made)))


def _unknown_mechanism(told: Mapping[str, Any]) -> str:
    joints = joints_of(told)
    if mechanisms_of(joints):
        return ""
    return (
        f"`exoid run` ends at the motions of these: {in_words(joints)} make no mechanism that exoid"
        " could fit; leave joints out of the map"
    )
