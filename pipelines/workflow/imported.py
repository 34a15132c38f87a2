"""Runs whose recordings came from elsewhere: no command of an experiment makes these, or could make
them again."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.contracts import parquet
from pipelines.contracts.joints import HIP_AND_KNEE, joints_of
from pipelines.contracts.provenance import told_by
from pipelines.errors import InputError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.experiment import Experiment


@dataclass(frozen=True)
class ImportedRuns:
    """What a graph must know of them."""

    names: frozenset[str] = frozenset()
    of_a_leg: bool = True
    """Whether they are of hip and knee, whose gait the adaptive loop follows."""
    damaged: tuple[Path, ...] = ()
    """Files among them that can no longer be read: of which run they are, and for what, nobody
    knows."""

    def refuse_damaged(self) -> None:
        """Refuse to go on without a recording that was there: the results would be of the others
        alone."""
        if self.damaged:
            raise InputError(damage(self.damaged))


def damage(files: Sequence[Path]) -> str:
    """Say which recordings cannot be read, and what to do."""
    names, several = ", ".join(file.as_posix() for file in files), len(files) > 1
    return (
        f"{names}: {DAMAGED}, and nothing is done without {'them' if several else 'it'};"
        f" {'import them' if several else 'import it'} again, or remove"
        f" {'them' if several else 'it'}"
    )


DAMAGED = "damaged or truncated"


def with_imported(experiment: Experiment, out: Path) -> tuple[Experiment, ImportedRuns]:
    """Return the experiment with its runs, and those whose recordings were imported.

    Where exoid.toml names no run, the imported recordings in the folder of the results are the
    runs: each says itself which kind of run it is, and for which purpose.
    """
    files = sorted((out / "recordings").glob("*.parquet"))
    found = dict(_imported(files))
    damaged = tuple(_damaged(experiment, bool(found), files))
    if found and "run" not in experiment.model_fields_set:
        # Not validated: a recording may be called what no [[run]] is.
        runs = [
            RunSettings.model_construct(name=name, run=told["run"], purpose=told["purpose"])
            for name, told in found.items()
        ]
        experiment = experiment.model_copy(update={"run": tuple(runs)})
    names = frozenset(run.name for run in experiment.run if run.name in found)
    return experiment, ImportedRuns(
        names, all(joints_of(found[name]) == HIP_AND_KNEE for name in names), damaged
    )


def _damaged(experiment: Experiment, imported: bool, files: Iterable[Path]) -> Iterator[Path]:
    """Yield the damaged files that were imported, as far as others tell: they themselves tell
    nothing any more."""
    named = {run.name for run in experiment.run}
    if "run" in experiment.model_fields_set:
        counted = named if imported else set[str]()  # else the rig's, which can be recorded anew
        files = [file for file in files if file.stem in counted]
    elif not imported:
        files = [file for file in files if file.stem not in named]
    yield from (file for file in files if file.is_file() and not parquet.is_whole(file))


def imported_in(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the metadata of the imported recordings in a folder, by their names."""
    return dict(_imported(sorted(folder.glob("*.parquet"))))


def refuse_imported(path: Path) -> None:
    """Refuse to record where an imported recording is: make may not know yet that it is none of
    ours to make."""
    if dict(_imported([path])):
        raise InputError(
            f"{path}: was imported, not overwritten; name another file with -o, or move it away"
        )


def _imported(paths: Iterable[Path]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path in paths:
        told = told_by(path)
        if "imported" in told:
            yield path.stem, told
