"""A session as its folders hold it: every file of exoid's, known by its contract and not by its
name."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from pipelines.contracts import Joint, Table, contract_of, joints_of, parquet
from pipelines.contracts import verdict as verdicts
from pipelines.contracts.provenance import sha256
from pipelines.errors import ContractError, InputError

DOCUMENTS = ("verdict/1", "detectability/1")
OURS = re.compile(r'"contract"\s*:\s*"(?:verdict|detectability)/')
"""What a damaged document of exoid's still says of itself."""


@dataclass(frozen=True)
class Artifact:
    """One file that a stage wrote."""

    path: Path
    contract: str
    """Name and version, as ``residuals/1``."""
    metadata: dict[str, Any]
    """Of a table what its ``exoid`` entry holds; of a document its ``provenance``."""
    sha256: str

    @property
    def kind(self) -> str:
        """The contract's name."""
        return self.contract.partition("/")[0]

    @property
    def inputs(self) -> list[dict[str, str]]:
        """Name and SHA-256 of every file that it was computed from."""
        return self.metadata.get("inputs") or []

    @property
    def causes(self) -> dict[str, str] | None:
        """Name and hash of the diagnosis' file whose causes a model refits; None of any other."""
        return self.method.get("causes")

    @property
    def effects(self) -> list[str]:
        """Labels of what a model was told to have beside rigid body and friction."""
        return list(self.method.get("effects") or [])

    @property
    def besides(self) -> str:
        """What a model of ``exoid identify`` has beside rigid body and friction, in words; nothing
        of a baseline."""
        return ", ".join([*(["the named causes, refitted"] if self.causes else []), *self.effects])

    @property
    def method(self) -> dict[str, Any]:
        """How a model was found."""
        stated = self.metadata.get("method")
        return stated if isinstance(stated, dict) else {}

    def is_made_of(self, other: "Artifact") -> bool:
        """Tell whether the other file, byte for byte, is one of its inputs."""
        return any(one["sha256"] == other.sha256 for one in self.inputs)


@dataclass(frozen=True)
class Session:
    """What was found in some folders."""

    folders: tuple[Path, ...]
    artifacts: tuple[Artifact, ...]
    unreadable: dict[Path, str] = field(default_factory=dict)
    """What is wrong with each file that looks like exoid's."""
    config: Path | None = None
    _tables: dict[Path, Table] = field(default_factory=dict, repr=False, compare=False)

    @property
    def name(self) -> str:
        """The name of the first folder."""
        return self.folders[0].resolve().name

    def of_kind(self, kind: str) -> list[Artifact]:
        """Return the files of one contract, in the order of their paths."""
        return [one for one in self.artifacts if one.kind == kind]

    def file_of(self, name: str, digest: str) -> Path | None:
        """Return the file of these bytes, whoever made it; None where the folders hold none of them
        under that name."""
        ours = (one.path for one in self.artifacts if one.sha256 == digest)
        return next(ours, None) or next(
            (p for p in self._others if p.name == name and sha256(p) == digest), None
        )

    @cached_property
    def _others(self) -> list[Path]:
        """Every file of the folders that no stage wrote: maps, logs, settings."""
        known = {one.path for one in self.artifacts}
        return [path for folder in self.folders for path in _below(folder) if path not in known]

    def shown(self, path: Path) -> str:
        """Return a path as the page writes it: below the session's folder, with slashes."""
        for folder in self.folders:
            if path.is_relative_to(folder):
                inside = path.relative_to(folder).as_posix()
                return inside if len(self.folders) == 1 else f"{folder.name}/{inside}"
        return path.as_posix()

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The machine's joints, as the file that says most says them."""
        order = (
            "parameters",
            "residuals",
            "motion",
            "recording",
            "trajectory",
            "simulation",
            "verdict",
        )
        sets = sorted(
            (one for one in self.artifacts if one.kind in order),
            key=lambda one: order.index(one.kind),
        )
        return joints_of(sets[0].metadata) if sets else ()

    @cached_property
    def verdict_file(self) -> Artifact | None:
        """The diagnosis's file: the only one, or that in ``diagnosed/``, where `make` has it; two
        would contradict.

        Raises
        ------
        InputError
            Where there are several, and none in ``diagnosed/``.
        """
        files = self.of_kind("verdict")
        usual = [
            one
            for one in files
            if one.path.parent in [folder / "diagnosed" for folder in self.folders]
        ]
        files = usual or files
        if len(files) > 1:
            names = ", ".join(self.shown(one.path) for one in files)
            raise InputError(
                f"{self.folders[0]}: holds {len(files)} verdicts ({names}), expected one; name the"
                " folders of one diagnosis, or lay two sessions side by side with --compare"
            )
        return files[0] if files else None

    @cached_property
    def verdict(self) -> dict[str, Any] | None:
        """What the diagnosis says; None where none was made."""
        return verdicts.read(self.verdict_file.path) if self.verdict_file else None

    @property
    def has_damaged_verdict(self) -> bool:
        """Whether there is a verdict that cannot be read, and no other."""
        return not self.verdict_file and any(
            path.name == "verdict.json" for path in self.unreadable
        )

    @cached_property
    def extended(self) -> Artifact | None:
        """The parameters of the model with the named causes: those beside the verdict."""
        return self._next_to_verdict("parameters")

    @cached_property
    def identified(self) -> list[Artifact]:
        """The other models, as ``exoid identify`` writes them: the baselines, then those that have
        more."""
        others = [one for one in self.of_kind("parameters") if one is not self.extended]
        return sorted(others, key=lambda one: bool(one.besides))

    @property
    def baselines(self) -> list[Artifact]:
        """Those of rigid body and friction alone."""
        return [one for one in self.identified if not one.besides]

    @cached_property
    def residuals(self) -> Table | None:
        """What is left before and after; of the identification alone where no diagnosis was
        made."""
        file = self._next_to_verdict("residuals") or next(iter(self.of_kind("residuals")), None)
        return self.table(file) if file else None

    @cached_property
    def candidates(self) -> Table | None:
        """Every cause that was tried."""
        file = self._next_to_verdict("candidates")
        return self.table(file) if file else None

    def table(self, artifact: Artifact) -> Table:
        """Return a file's checked table, read once."""
        if artifact.path not in self._tables:
            self._tables[artifact.path] = contract_of(artifact.path).read(artifact.path)
        return self._tables[artifact.path]

    def simulations(self, model: Artifact | None) -> list[Artifact]:
        """Return the simulations of one model, byte for byte."""
        return [one for one in self.of_kind("simulation") if model and one.is_made_of(model)]

    def simulations_by_model(self, what: str) -> dict[str, list[Artifact]]:
        """Return the simulations of a kind on the ``baseline`` and on the ``extended`` model (see
        ``simulated``)."""
        baseline = [one for model in self.baselines for one in self.simulations(model)]
        extended = self.simulations(self.extended)
        return {
            "baseline": [one for one in baseline if simulated(one) == what],
            "extended": [one for one in extended if simulated(one) == what],
        }

    def recorded(self, artifact: Artifact) -> Artifact | None:
        """Return the recording or motion that a replay was made of."""
        return next(
            (
                one
                for one in self.artifacts
                if one.kind in ("recording", "motion") and artifact.is_made_of(one)
            ),
            None,
        )

    def _next_to_verdict(self, kind: str) -> Artifact | None:
        if self.verdict_file is None:
            return None
        folder = self.verdict_file.path.parent
        return next((one for one in self.of_kind(kind) if one.path.parent == folder), None)


def simulated(artifact: Artifact) -> str:
    """Say what a ``simulation/1`` file holds: ``loop`` (adaptive control), ``windows`` or
    ``drives`` (replays)."""
    if "windows" in artifact.metadata:
        return "windows"
    return "drives" if "closed_loop_rmse_rad" in artifact.metadata else "loop"


def find(folders: Sequence[Path], config: Path | None = None) -> Session:
    """Return what some folders hold, or refuse folders that hold nothing of exoid's."""
    artifacts: dict[Path, Artifact] = {}
    unreadable: dict[Path, str] = {}
    for folder in folders:
        if not folder.is_dir():
            what = "is a file" if folder.exists() else "no such folder"
            raise InputError(
                f"{folder}: {what}, expected an experiment's folder; name the one that its stages"
                " wrote to"
            )
        for path in _files(folder):
            try:
                artifact = _artifact(path)
            except ContractError as error:
                unreadable[path] = str(error)
                continue
            if artifact:
                artifacts.setdefault(path.resolve(), artifact)
    if config is None:
        config = next(
            (path for folder in folders if (path := folder / "exoid.toml").is_file()), None
        )
    if not artifacts:
        reason = f" ({next(iter(unreadable.values()))})" if unreadable else ""
        where = ", ".join(map(str, folders))
        raise InputError(
            f"{where}: no file of exoid's in it{reason}, expected recordings, models or a verdict; "
            "name the folder that `make` or `exoid diagnose` wrote to"
        )
    return Session(tuple(folders), tuple(artifacts.values()), unreadable, config)


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in _below(folder) if path.suffix in (".parquet", ".json"))


def _below(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if not hidden and path.is_file():
            yield path


def _artifact(path: Path) -> Artifact | None:
    if path.suffix == ".json":
        return _document(path)
    _, metadata = parquet.header(path)
    contract_of(path)
    return Artifact(path, metadata["contract"], metadata, sha256(path))


def _document(path: Path) -> Artifact | None:
    try:
        content = verdicts.parsed(path)
    except ContractError:
        if path.name == "verdict.json" or OURS.search(
            path.read_text(encoding="utf-8", errors="replace")
        ):
            raise
        return None  # somebody else's
    contract = content.get("contract") if isinstance(content, dict) else None
    if contract not in DOCUMENTS:
        return None
    if contract == "verdict/1":
        verdicts.check(content, str(path))
    return Artifact(path, contract, content.get("provenance", {}), sha256(path))
