"""Recordings that no command of an experiment makes again, and runs whose recordings these are."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.contracts import parquet
from pipelines.contracts.joints import HIP_AND_KNEE, joints_of
from pipelines.contracts.provenance import metadata_of
from pipelines.errors import InputError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.experiment import Experiment


@dataclass(frozen=True)
class ImportedRuns:
    """The runs of an experiment whose recordings were imported."""

    names: frozenset[str] = frozenset()
    of_a_leg: bool = True
    """Whether they are of hip and knee, whose gait the adaptive loop follows."""
    damaged: tuple[Path, ...] = ()
    """Imported recordings that cannot be read, so that their run and purpose are unknown."""

    def refuse_damaged(self) -> None:
        """Refuse to compute results without a recording that is damaged.

        Raises
        ------
        InputError
            Names the damaged files.
        """
        if self.damaged:
            them = "them" if len(self.damaged) > 1 else "it"
            raise InputError(
                f"{', '.join(file.as_posix() for file in self.damaged)}: damaged or truncated, and"
                f" nothing is done without {them}; import {them} again, or remove {them}"
            )


def with_imported(experiment: Experiment, out: Path) -> tuple[Experiment, ImportedRuns]:
    """Return the experiment with its runs, and those whose recordings were imported.

    Without a run in exoid.toml, the imported recordings in the folder of the results are the runs;
    their metadata hold the kind of run and the purpose.
    """
    files = sorted((out / "recordings").glob("*.parquet"))
    imported = dict(_imported(files))
    damaged = tuple(_damaged(experiment, bool(imported), files))
    if imported and "run" not in experiment.model_fields_set:
        # Not validated: a recording's name need not be a valid name of a [[run]].
        runs = [
            RunSettings.model_construct(name=name, run=metadata["run"], purpose=metadata["purpose"])
            for name, metadata in imported.items()
        ]
        experiment = experiment.model_copy(update={"run": tuple(runs)})
    names = frozenset(run.name for run in experiment.run if run.name in imported)
    # True without imported runs, because `exoid acquire` supports hip and knee only.
    of_a_leg = all(joints_of(imported[name]) == HIP_AND_KNEE for name in names)
    return experiment, ImportedRuns(names, of_a_leg, damaged)


def _damaged(experiment: Experiment, imported: bool, files: Iterable[Path]) -> Iterator[Path]:
    """Yield the damaged files that were probably imported; their own metadata are unreadable."""
    names = {run.name for run in experiment.run}
    if "run" in experiment.model_fields_set:
        # Without an imported recording, they are the rig's, which can be recorded again.
        files = [file for file in files if imported and file.stem in names]
    elif not imported:
        files = [file for file in files if file.stem not in names]
    yield from (file for file in files if file.is_file() and not parquet.is_whole(file))


def imported_in(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the metadata of the imported recordings in a folder, by their names."""
    return dict(_imported(sorted(folder.glob("*.parquet"))))


def refuse_imported(path: Path) -> None:
    """Refuse to overwrite an imported recording; make's rules may be older than the import.

    Parameters
    ----------
    path : Path
        The file to write.

    Raises
    ------
    InputError
        Names the path.
    """
    if dict(_imported([path])):
        raise InputError(
            f"{path}: was imported, not overwritten; name another file with -o, or move it away"
        )


def refuse_recorded(path: Path) -> None:
    """Refuse to overwrite a real rig's recording; a virtual leg's can be recorded again.

    Parameters
    ----------
    path : Path
        The file to write.

    Raises
    ------
    InputError
        Names the path and the rig.
    """
    rig = real_rig_of(path)
    if rig is not None:
        raise InputError(
            f"{path}: is a recording of the rig {rig}, not overwritten; --overwrite"
            " replaces it, -o writes another file"
        )


def real_rig_of(recording: Path) -> str | None:
    """Return the name of the real rig that made a recording; None for any other file."""
    rig = metadata_of(recording).get("config", {}).get("rig", {})
    return rig["name"] if rig and not rig["embedded"] else None


def _imported(paths: Iterable[Path]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path in paths:
        metadata = metadata_of(path)
        if "imported" in metadata:
            yield path.stem, metadata
