"""A session: the files of exoid in some folders, recognized by their contracts, not their names."""

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
from pipelines.settings import Experiment
from pipelines.workflow.investigation import verdicts_before_steps


@dataclass(frozen=True)
class Artifact:
    """One file that a stage wrote."""

    path: Path
    contract: str
    """Name and version, as ``residuals/1``."""
    metadata: dict[str, Any]
    """The ``exoid`` entry of a table, or the ``provenance`` of a document."""
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
        """Name and hash of the file whose causes a model refits; None for other models."""
        return self.method.get("causes")

    @property
    def effects(self) -> list[str]:
        """Labels of the effects given with ``--effect``."""
        return list(self.method.get("effects") or [])

    @property
    def additions(self) -> str:
        """The effects of an identified model in addition to the baseline's, in words."""
        causes = ["the named causes, refitted"] if self.causes else []
        return ", ".join([*causes, *self.effects])

    @property
    def method(self) -> dict[str, Any]:
        """The method with which a model was identified."""
        stated = self.metadata.get("method")
        return stated if isinstance(stated, dict) else {}

    def has_input(self, other: "Artifact") -> bool:
        """Return whether the other file, byte for byte, is one of its inputs."""
        return any(one["sha256"] == other.sha256 for one in self.inputs)


@dataclass(frozen=True)
class Session:
    """The files of exoid in some folders."""

    folders: tuple[Path, ...]
    artifacts: tuple[Artifact, ...]
    unreadable: dict[Path, str] = field(default_factory=dict)
    """The error of each file of exoid that cannot be read."""
    config: Path | None = None
    _tables: dict[Path, Table] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def experiment(self) -> Experiment | None:
        """The settings as exoid.toml has them now; None without that file."""
        return Experiment.load(self.config) if self.config else None

    @property
    def name(self) -> str:
        """The name of the first folder."""
        return self.folders[0].resolve().name

    def of_kind(self, kind: str) -> list[Artifact]:
        """Return the files of one contract, in the order of their paths."""
        return [one for one in self.artifacts if one.kind == kind]

    def file_of(self, name: str, digest: str) -> Path | None:
        """Return the file with some bytes, of any origin.

        Parameters
        ----------
        name : str
            Its name, which counts for a file that no stage wrote.
        digest : str
            SHA-256 of its bytes, in hexadecimal.

        Returns
        -------
        Path or None
            None if the folders lack it.
        """
        # By its bytes, as it may have been renamed since it was used.
        for one in self.artifacts:
            if one.sha256 == digest:
                return one.path
        # By name first: hashing every log of a folder may read gigabytes.
        same_name = (path for path in self._others if path.name == name)
        return next((path for path in same_name if sha256(path) == digest), None)

    @cached_property
    def _others(self) -> list[Path]:
        """The files that no stage wrote: maps, logs, settings."""
        known = {one.path for one in self.artifacts}
        return [path for folder in self.folders for path in _below(folder) if path not in known]

    def shown(self, path: Path) -> str:
        """Return a path for display: relative to the session's folder, with slashes."""
        for folder in self.folders:
            if path.is_relative_to(folder):
                inside = path.relative_to(folder).as_posix()
                return inside if len(self.folders) == 1 else f"{folder.name}/{inside}"
        return path.as_posix()

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The machine's joints, from the first kind of file that the session has."""
        # Kinds of file whose metadata hold the joints, the most reliable first.
        of_machine = (
            "parameters",
            "residuals",
            "motion",
            "recording",
            "trajectory",
            "simulation",
            "verdict",
        )
        for kind in of_machine:
            for artifact in self.of_kind(kind):
                return joints_of(artifact.metadata)
        return ()

    @property
    def measured_joints(self) -> tuple[Joint, ...]:
        """The joints whose torque is known; the others have no error."""
        return tuple(joint for joint in self.joints if joint.is_measured)

    @cached_property
    def verdict_file(self) -> Artifact | None:
        """The verdict: the only one, or the one in ``diagnosed/``.

        Verdicts that a step of an investigation began with are history.

        Raises
        ------
        InputError
            If there are several, and none or several in ``diagnosed/``.
        """
        history = {file for folder in self.folders for file in verdicts_before_steps(folder)}
        files = [one for one in self.of_kind("verdict") if one.path not in history]
        usual = [folder / "diagnosed" for folder in self.folders]
        # Other folders may hold diagnoses that were made by hand; the stage's own one counts.
        files = [one for one in files if one.path.parent in usual] or files
        if len(files) > 1:
            names = ", ".join(self.shown(one.path) for one in files)
            raise InputError(
                f"{self.folders[0]}: holds {len(files)} verdicts ({names}), expected one. Name the"
                " folders of one diagnosis, or compare two sessions with --compare"
            )
        return files[0] if files else None

    @cached_property
    def verdict(self) -> verdicts.Verdict | None:
        """The verdict; None without a diagnosis."""
        return verdicts.read(self.verdict_file.path) if self.verdict_file else None

    @property
    def causes(self) -> list[verdicts.Cause]:
        """The named causes; empty without a diagnosis."""
        return self.verdict.causes if self.verdict else []

    def noise_floor(self, joint: Joint) -> float | None:
        """Return the noise floor at a joint, N·m; None without a diagnosis."""
        return self.verdict.noise_floor_nm.get(joint.name) if self.verdict else None

    def dependences(self, joint: Joint) -> list[verdicts.Dependence]:
        """Return the variables on which a joint's error depends; empty without a diagnosis."""
        return self.verdict.depends_on.get(joint.name, []) if self.verdict else []

    @property
    def has_damaged_verdict(self) -> bool:
        """Whether the only verdict cannot be read."""
        names = [path.name for path in self.unreadable]
        return not self.verdict_file and "verdict.json" in names

    @cached_property
    def extended(self) -> Artifact | None:
        """The parameters of the model with the named causes, in the verdict's folder."""
        return self._next_to_verdict("parameters")

    @cached_property
    def identified(self) -> list[Artifact]:
        """The models of ``exoid identify``, baselines first."""
        others = [one for one in self.of_kind("parameters") if one is not self.extended]
        # False sorts first, and the sort keeps the order of the paths.
        return sorted(others, key=lambda one: bool(one.additions))

    @property
    def baselines(self) -> list[Artifact]:
        """The models of rigid body and friction only."""
        return [one for one in self.identified if not one.additions]

    @cached_property
    def residuals(self) -> Table | None:
        """The residuals of the diagnosis, else of the identification."""
        file = self._next_to_verdict("residuals") or next(iter(self.of_kind("residuals")), None)
        return self.table(file) if file else None

    @cached_property
    def candidates(self) -> Table | None:
        """Every set of causes that was compared."""
        file = self._next_to_verdict("candidates")
        return self.table(file) if file else None

    def table(self, artifact: Artifact) -> Table:
        """Return a file's checked table, read once."""
        if artifact.path not in self._tables:
            self._tables[artifact.path] = contract_of(artifact.path).read(artifact.path)
        return self._tables[artifact.path]

    def simulations_by_model(self, kind: str) -> dict[str, list[Artifact]]:
        """Return the simulations of a kind of the ``baseline`` and the ``extended`` model."""
        of_kind = [one for one in self.of_kind("simulation") if simulation_kind(one) == kind]
        models = {"baseline": self.baselines, "extended": [self.extended] if self.extended else []}
        return {
            name: [one for model in files for one in of_kind if one.has_input(model)]
            for name, files in models.items()
        }

    def recorded(self, artifact: Artifact) -> Artifact | None:
        """Return the recording or motion of a replay."""
        runs = (one for one in self.artifacts if one.kind in ("recording", "motion"))
        return next((one for one in runs if artifact.has_input(one)), None)

    def _next_to_verdict(self, kind: str) -> Artifact | None:
        if self.verdict_file is None:
            return None
        folder = self.verdict_file.path.parent
        return next((one for one in self.of_kind(kind) if one.path.parent == folder), None)


def simulation_kind(artifact: Artifact) -> str:
    """Return the kind of a simulation: ``loop`` (adaptive control), ``windows`` or ``drives``.

    The last two are replays: in windows of a second, and in the drives' own loop.
    """
    if "windows" in artifact.metadata:
        return "windows"
    # Files of simulations state no kind: each has keys that the others lack.
    return "drives" if "closed_loop_rmse_rad" in artifact.metadata else "loop"


def find(folders: Sequence[Path], config: Path | None = None) -> Session:
    """Return the session in some folders.

    Raises
    ------
    InputError
        If a folder does not exist, or none holds a file of exoid.
    """
    artifacts: dict[Path, Artifact] = {}
    unreadable: dict[Path, str] = {}
    for folder in folders:
        if not folder.is_dir():
            problem = "is a file" if folder.exists() else "no such folder"
            raise InputError(
                f"{folder}: {problem}, expected an experiment's folder; name the one that its"
                " stages wrote to"
            )
        for path in _below(folder):
            if path.suffix not in (".parquet", ".json"):
                continue
            try:
                artifact = _artifact(path)
            except ContractError as error:
                unreadable[path] = str(error)
                continue
            if artifact:
                # By the resolved path: folders may be given twice, or one inside another.
                artifacts.setdefault(path.resolve(), artifact)
    if config is None:
        paths = (folder / "exoid.toml" for folder in folders)
        config = next((path for path in paths if path.is_file()), None)
    if not artifacts:
        reason = f" ({next(iter(unreadable.values()))})" if unreadable else ""
        where = ", ".join(map(str, folders))
        raise InputError(
            f"{where}: no file of exoid's in it{reason}, expected recordings, models or a verdict."
            " Name the folder that `make` or `exoid diagnose` wrote to"
        )
    return Session(tuple(folders), tuple(artifacts.values()), unreadable, config)


def _below(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        # Hidden folders hold temporary files and settings for make.
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if not hidden and path.is_file():
            yield path


def _artifact(path: Path) -> Artifact | None:
    if path.suffix == ".json":
        return _document(path)
    _, metadata = parquet.header(path)
    # Raises for a contract that exoid does not know, so that the file counts as unreadable.
    contract_of(path)
    return Artifact(path, metadata["contract"], metadata, sha256(path))


def _document(path: Path) -> Artifact | None:
    try:
        content = verdicts.parsed(path)
    except ContractError:
        # JSON that cannot be parsed counts as exoid's only if it looks like it; others are left
        # alone.
        text = path.read_text(encoding="utf-8", errors="replace")
        if path.name == "verdict.json" or re.search(
            r'"contract"\s*:\s*"(?:verdict|detectability)/', text
        ):
            raise
        return None  # Not written by exoid.
    contract = content.get("contract") if isinstance(content, dict) else None
    if contract not in ("verdict/1", "detectability/1"):
        return None
    if contract == "verdict/1":
        verdicts.check(content, str(path))
    return Artifact(path, contract, content.get("provenance", {}), sha256(path))
