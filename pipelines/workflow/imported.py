"""Runs whose recordings came from elsewhere: no command of an experiment makes these, or could make them again."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import provenance_of
from pipelines.errors import ContractError, InputError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.experiment import Experiment


def with_imported(experiment: Experiment, out: Path) -> tuple[Experiment, frozenset[str]]:
    """Return the experiment with its runs, and the names of those whose recordings were imported.

    Where exoid.toml names no run, the imported recordings in the folder of the results are the runs: each says itself
    which kind of run it is, and for which purpose.
    """
    found = dict(_imported(sorted((out / "recordings").glob("*.parquet"))))
    if found and "run" not in experiment.model_fields_set:
        # Not validated: a recording may be called what no [[run]] is.
        runs = [
            RunSettings.model_construct(name=name, run=told["run"], purpose=told["purpose"])
            for name, told in found.items()
        ]
        experiment = experiment.model_copy(update={"run": tuple(runs)})
    return experiment, frozenset(run.name for run in experiment.run if run.name in found)


def refuse_imported(path: Path) -> None:
    """Refuse to record where an imported recording is: make may not know yet that it is none of ours to make."""
    if dict(_imported([path])):
        raise InputError(f"{path}: was imported, not overwritten; name another file with -o, or move it away")


def _imported(paths: Iterable[Path]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path in paths:
        with suppress(ContractError):  # whoever reads it says what is wrong with it
            told = provenance_of(path)
            if "imported" in told:
                yield path.stem, told
