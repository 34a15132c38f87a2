"""Where everything on the page comes from: files, hashes, settings, and the command lines that make
them again."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipelines.report.session import Artifact, Session, simulated
from pipelines.settings import Experiment
from pipelines.settings.identify import IdentifySettings

SECTIONS = ("mechanism", "design", "filter", "identify", "simulate")
"""Sections of exoid.toml that a stage's file repeats; runs and rigs stand in the recordings."""


FEW = 3
"""Files that a warning names."""
AGAIN = "`exoid run` or `make` makes again what depends on it"


@dataclass(frozen=True)
class Input:
    """One file that another was computed from."""

    name: str
    sha256: str
    state: str
    """``found`` (the same bytes are in the session), ``changed`` (other bytes of that name are), or
    ``elsewhere``."""


@dataclass(frozen=True)
class Origin:
    """One file and what it was made of."""

    file: str
    contract: str
    created_by: str
    created_at: str
    sha256: str
    inputs: tuple[Input, ...]

    @property
    def here(self) -> list[str]:
        """Names of the inputs that the session holds, and so lists with their own hashes."""
        return [one.name for one in self.inputs if one.state == "found"]


def origins(session: Session) -> list[Origin]:
    """Return every file of a session, oldest first."""
    rows = [
        Origin(
            session.shown(one.path),
            one.contract,
            str(one.metadata.get("created_by") or "unknown"),
            str(one.metadata.get("created_at") or ""),
            one.sha256,
            tuple(_input(session, stated) for stated in one.inputs),
        )
        for one in session.artifacts
    ]
    return sorted(rows, key=lambda origin: (origin.created_at, origin.file))


def _input(session: Session, stated: dict[str, str]) -> Input:
    if session.file_of(stated["name"], stated["sha256"]):
        state = "found"
    else:
        state = (
            "changed"
            if any(one.path.name == stated["name"] for one in session.artifacts)
            else "elsewhere"
        )
    return Input(stated["name"], stated["sha256"], state)


@dataclass(frozen=True)
class Outside:
    """One file that others were made of and that the folders do not hold."""

    name: str
    """Its path where a file tells one."""
    role: str
    """What it is, as far as those made of it tell: files of one name may be an experiment's
    settings and a rig's."""
    sha256: str
    made_of_it: tuple[str, ...]


def outside(session: Session) -> list[Outside]:
    """Return every file that the folders lack, once, however many were made of it."""
    results: dict[str, Outside] = {}
    for one in session.artifacts:
        for stated in one.inputs:
            if _input(session, stated).state != "elsewhere":
                continue
            name, role = _role(one, stated["name"])
            before = results.get(stated["sha256"], Outside(name, role, stated["sha256"], ()))
            results[stated["sha256"]] = replace(
                before, made_of_it=(*before.made_of_it, session.shown(one.path))
            )
    return list(results.values())


def _role(artifact: Artifact, name: str) -> tuple[str, str]:
    """Return what a file that another was made of is called, with its path where that is told, and
    what it is."""
    imported = artifact.metadata.get("imported")
    if isinstance(imported, dict):
        which = "map" if name.endswith(".toml") else "source"
        given = (imported.get("given") or {}).get(which, name)
        return (given if Path(given).name == name else name), {
            "map": "the log's map",
            "source": "a log",
        }[which]
    config = artifact.metadata.get("config") or {}
    if artifact.kind == "recording" and "rig" in config and name.endswith(".toml"):
        return name, "the rig's file"
    return name, ""


def stale(session: Session) -> list[str]:
    """Return a sentence for each file of which other files were made when it was not yet as it is
    here."""
    by_file: dict[str, list[str]] = {}
    for origin in origins(session):
        for one in origin.inputs:
            if one.state == "changed":
                by_file.setdefault(one.name, []).append(origin.file)
    return [
        f"{name} has changed since {_few(files)} {'was' if len(files) == 1 else 'were'} made of it;"
        f" {AGAIN}"
        for name, files in by_file.items()
    ]


def _few(files: Sequence[str]) -> str:
    """Return files in words: some by name, the others by number."""
    more = [f"{len(files) - FEW} more files"] if len(files) > FEW else []
    *most, last = [*files[:FEW], *more]
    return f"{', '.join(most)} and {last}" if most else last


def software(session: Session) -> list[tuple[str, list[str]]]:
    """Return each set of versions that files were made with, in words, and these files; nothing
    where none tells."""
    versions: dict[str, list[str]] = {}
    for one in session.artifacts:
        stated = one.metadata.get("software")
        if isinstance(stated, dict) and stated:
            words = ", ".join(
                f"{'Python' if name == 'python' else name} {version}"
                for name, version in stated.items()
            )
            versions.setdefault(words, []).append(session.shown(one.path))
    return list(versions.items())


def settings(session: Session) -> dict[str, dict[str, Any]]:
    """Return every section of the settings that the files were made with, as they were resolved."""
    values: dict[str, dict[str, Any]] = {}
    for artifact in session.artifacts:
        values |= resolved(artifact)
    return {name: values[name] for name in SECTIONS if name in values}


def resolved(artifact: Artifact) -> dict[str, dict[str, Any]]:
    """Return the sections that one file's ``config`` tells, by name; those that are no section are
    left out."""
    config = artifact.metadata.get("config") or {}
    return {name: config[name] for name in SECTIONS if isinstance(config.get(name), dict)}


def changed_settings(session: Session) -> list[str]:
    """Return a sentence for each section of exoid.toml that files were made with when it was
    another."""
    if session.config is None:
        return []
    now = Experiment.load(session.config)
    by_value: dict[str, list[str]] = {}
    for one in session.artifacts:
        for name, setting in resolved(one).items():
            is_now = getattr(now, name).model_dump(mode="json")
            if any(setting[key] != value for key, value in is_now.items() if key in setting):
                by_value.setdefault(name, []).append(session.shown(one.path))
    return [
        f"{_few(files)} {'was' if len(files) == 1 else 'were'} made with another [{name}] than"
        f" {session.config.name} has now; {AGAIN}"
        for name, files in by_value.items()
    ]


@dataclass(frozen=True)
class Command:
    """A command line, and the files that it makes."""

    line: str
    needs_settings: bool
    """Whether an exoid.toml is named that the session was not told of."""


def commands(
    session: Session, output: Path | None = None, title: str | None = None
) -> list[Command]:
    """Return the command lines that make the session's files again, in their order, and then the
    page."""
    named = session.config and session.config.parent not in session.folders
    results = [
        command
        for kind in _MADE_BY
        for one in session.of_kind(kind)
        if (command := _MADE_BY[kind](session, one))
    ]
    page = [
        "report",
        *map(str, session.folders),
        *(["--config", str(session.config)] if named else []),
    ]
    page += ["--title", title] if title else []
    results.append((page + (["-o", str(output)] if output else []), False))
    lines = dict.fromkeys((shlex.join(["exoid", *words]), needs) for words, needs in results)
    return [Command(line, needs) for line, needs in lines]


Words = tuple[list[str], bool]


def _config(session: Session, artifact: Artifact, *, always: bool = False) -> Words:
    """Return the option that names the settings; none where the defaults do."""
    if session.config:
        return ["--config", str(session.config)], False
    defaults = Experiment()
    usual = all(
        value == getattr(defaults, name).model_dump(mode="json")
        for name, value in resolved(artifact).items()
    )
    return ([], False) if usual and not always else (["--config", "exoid.toml"], True)


def _path_of(session: Session, stated: dict[str, str]) -> str:
    return str(session.file_of(stated["name"], stated["sha256"]) or stated["name"])


def _inputs(session: Session, artifact: Artifact) -> list[str]:
    return [_path_of(session, stated) for stated in artifact.inputs]


def _folder(path: Path) -> str:
    return f"{path.parent}/"


def _design(session: Session, artifact: Artifact) -> Words | None:
    config, needs = _config(session, artifact)
    return ["design", *config, "-o", str(artifact.path)], needs


def _record(session: Session, artifact: Artifact) -> Words | None:
    inputs = _inputs(session, artifact)
    if "imported" in artifact.metadata:
        return _import(session, artifact, inputs), False
    run = (artifact.metadata.get("config") or {}).get("run") or {}
    if not run or not inputs:
        return None
    config, needs = _config(session, artifact, always=True)
    return [
        "acquire",
        *config,
        "--run",
        run["name"],
        "--trajectory",
        inputs[0],
        "-o",
        str(artifact.path),
    ], needs


def _import(session: Session, artifact: Artifact, inputs: list[str]) -> list[str]:
    """Return the words that import a log: where it lies in these folders, else where the command
    had it."""
    log, given = artifact.inputs, artifact.metadata["imported"].get("given") or {}
    # Not in these folders.
    names = [name for name, one in zip(inputs, log, strict=True) if name == one["name"]]
    maps = [name for name in inputs if name.endswith(".toml")]
    sources = [name for name in inputs if name not in maps]
    if any(name in names for name in sources) and given:
        sources = [given["source"]]
    if maps and maps[0] in names and given:
        maps = [given["map"]]
    return ["import", *sources, *(["--map", maps[0]] if maps else []), "-o", _folder(artifact.path)]


def _filter(session: Session, artifact: Artifact) -> Words | None:
    config, needs = _config(session, artifact)
    return ["filter", *_inputs(session, artifact), *config, "-o", str(artifact.path)], needs


def _identify(session: Session, artifact: Artifact) -> Words | None:
    if artifact is session.extended:
        return None  # the diagnosis's
    config, needs = _config(session, artifact)
    causes = [_path_of(session, artifact.causes)] if artifact.causes else []
    runs = [path for path in _inputs(session, artifact) if path not in causes]
    words = [word for path in causes for word in ("--causes", path)]
    words += [word for label in artifact.effects for word in ("--effect", label)]
    asked = resolved(artifact).get("identify") or {}
    if asked.get("method", IdentifySettings().method) != IdentifySettings().method:
        words += ["--method", asked["method"]]
    words += ["--reversals"] * bool(asked.get("reversals"))
    return ["identify", *runs, *words, *config, "-o", _folder(artifact.path)], needs


def _diagnose(session: Session, artifact: Artifact) -> Words | None:
    config, needs = _config(session, artifact)
    return [
        "diagnose",
        *_inputs(session, artifact),
        *config,
        "--out",
        _folder(artifact.path),
    ], needs


def _simulate(session: Session, artifact: Artifact) -> Words | None:
    inputs = _inputs(session, artifact)
    what = simulated(artifact)
    if what == "drives" or not inputs:
        return None  # written beside the replay in windows
    config, needs = _config(session, artifact)
    if what == "windows":
        return [
            "simulate",
            inputs[0],
            "--replay",
            inputs[-1],
            *config,
            "-o",
            str(artifact.path),
        ], needs
    reference = ["--reference", inputs[1]] if len(inputs) > 1 else []
    run = artifact.metadata.get("plant", {}).get("run", "with_human")
    which = [] if run == "with_human" else ["--run", run]
    return ["simulate", inputs[0], *reference, *which, *config, "-o", _folder(artifact.path)], needs


_MADE_BY = {
    "trajectory": _design,
    "recording": _record,
    "motion": _filter,
    "parameters": _identify,
    "verdict": _diagnose,
    "simulation": _simulate,
}
"""By contract, in the order of an experiment: the words of the command that makes such a file."""
