"""The folder after an import: recordings of an earlier map, and recordings still missing."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipelines.contracts.joints import in_words, joints_of
from pipelines.mechanics.machine import mechanisms_of
from pipelines.settings.import_map import ImportMap

Metadata = Mapping[str, Mapping[str, Any]]
"""Metadata of the imported recordings in a folder, by name (``imported_in``)."""


def outdated(imported: Metadata, current: Collection[str]) -> list[str]:
    """Return the files of the same logs as the current recordings, but from an earlier map."""
    # By the hash of the log, as names of recordings change with the map.
    logs = {sha for name in current for sha in imported[name]["imported"]["sha256"]}
    return [
        f"{name}.parquet"
        for name, metadata in imported.items()
        if name not in current and not logs.isdisjoint(metadata["imported"]["sha256"])
    ]


def unused(settings: ImportMap, files: Collection[Path]) -> Iterator[str]:
    """Yield a message for each recording of a map that fits none of the files."""
    for number, recording in enumerate(settings.recording):
        if not any(map(recording.is_of, files)):
            yield (
                f"recording[{number}] ({recording.purpose}): no given file matches"
                f' "{recording.files}"; left out'
            )


def missing_for_verdict(
    imported: Metadata, current: Collection[str], map_path: Path
) -> Iterator[str]:
    """Yield a message for each reason why the recordings in a folder give no verdict."""
    # Of all recordings in the folder: training may come from one import, validation from another.
    purposes = {metadata["purpose"] for metadata in imported.values()}
    for purpose, use in (("train", "to fit to"), ("validate", "to judge on")):
        if purpose not in purposes:
            yield (
                f"`exoid run` lacks a recording {use}: add a [[recording]] to {map_path} with "
                f'purpose = "{purpose}", and a span or files of its own'
            )
    machines = [joints_of(imported[name]) for name in current]
    for joints in dict.fromkeys(in_words(one) for one in machines if not mechanisms_of(one)):
        yield (
            f"`exoid run` stops after filtering: {joints} make no mechanism that exoid can"
            " fit; leave some out"
        )
