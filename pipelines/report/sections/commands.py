"""Command lines that make the files of a session again."""

import shlex
from pathlib import Path

from pipelines.report.sections.provenance import resolved
from pipelines.report.session import Artifact, Session, simulation_kind
from pipelines.settings import Experiment
from pipelines.settings.identify import IdentifySettings


def commands(session: Session, output: Path | None = None, title: str | None = None) -> list[str]:
    """Return the command lines that make the session's files again, in order, then the page."""
    # By contract, in the order of an experiment.
    makers = {
        "trajectory": _design,
        "recording": _record,
        "motion": _filter,
        "parameters": _identify,
        "verdict": _diagnose,
        "simulation": _simulate,
    }
    stages = [make(session, one) for kind, make in makers.items() for one in session.of_kind(kind)]
    page = ["report", *map(str, session.folders)]
    if session.config and session.config.parent not in session.folders:
        page += ["--config", str(session.config)]
    if title:
        page += ["--title", title]
    if output:
        page += ["-o", str(output)]
    # One command makes several files, so its line comes up more than once.
    return list(dict.fromkeys(shlex.join(["exoid", *words]) for words in [*stages, page] if words))


def _config(session: Session, artifact: Artifact, *, always: bool = False) -> list[str]:
    """Return the option that names the settings; none if the defaults suffice."""
    if session.config:
        return ["--config", str(session.config)]
    defaults = Experiment()
    # Files state their settings, so equal defaults make the same result without exoid.toml.
    usual = all(
        value == getattr(defaults, name).model_dump(mode="json")
        for name, value in resolved(artifact).items()
    )
    return [] if usual and not always else ["--config", "exoid.toml"]


def _path_of(session: Session, stated: dict[str, str]) -> str:
    return str(session.file_of(stated["name"], stated["sha256"]) or stated["name"])


def _inputs(session: Session, artifact: Artifact) -> list[str]:
    return [_path_of(session, stated) for stated in artifact.inputs]


def _folder(path: Path) -> str:
    return f"{path.parent}/"


def _design(session: Session, artifact: Artifact) -> list[str]:
    used, now = resolved(artifact).get("design") or {}, session.experiment
    # Options that took the place of the settings.
    options = [
        word
        for key in ("criterion", "harmonics", "seed")
        if now and key in used and used[key] != getattr(now.design, key)
        for word in (f"--{key}", str(used[key]))
    ]
    return ["design", *_config(session, artifact), *options, "-o", str(artifact.path)]


def _record(session: Session, artifact: Artifact) -> list[str]:
    inputs = _inputs(session, artifact)
    if "imported" in artifact.metadata:
        return _import(artifact, inputs)
    run = (artifact.metadata.get("config") or {}).get("run") or {}
    if not run or not inputs:
        return []
    config = _config(session, artifact, always=True)
    words = ["acquire", *config, "--run", run["name"], "--trajectory", inputs[0]]
    return [*words, "-o", str(artifact.path)]


def _import(artifact: Artifact, inputs: list[str]) -> list[str]:
    """Return the words that import a log, by its path in these folders or in the first import."""
    given = artifact.metadata["imported"].get("given") or {}
    stated = zip(inputs, artifact.inputs, strict=True)
    # A bare name: the folders lack a file with these bytes.
    absent = [name for name, one in stated if name == one["name"]]
    maps = [name for name in inputs if name.endswith(".toml")]
    sources = [name for name in inputs if name not in maps]
    if any(name in absent for name in sources) and given:
        sources = [given["source"]]
    if maps and maps[0] in absent and given:
        maps = [given["map"]]
    return ["import", *sources, *(["--map", maps[0]] if maps else []), "-o", _folder(artifact.path)]


def _filter(session: Session, artifact: Artifact) -> list[str]:
    cutoff_hz = (resolved(artifact).get("filter") or {}).get("cutoff_hz", "auto")
    now = session.experiment
    changed = now is not None and cutoff_hz != now.filter.cutoff_hz
    option = ["--cutoff-hz", str(cutoff_hz)] if changed else []
    words = ["filter", *_inputs(session, artifact), *_config(session, artifact), *option]
    return [*words, "-o", str(artifact.path)]


def _identify(session: Session, artifact: Artifact) -> list[str]:
    if artifact is session.extended:
        return []  # The diagnosis writes it.
    # Among the inputs, but given by an option of its own.
    causes = [_path_of(session, artifact.causes)] if artifact.causes else []
    runs = [path for path in _inputs(session, artifact) if path not in causes]
    words = [word for path in causes for word in ("--causes", path)]
    words += [word for label in artifact.effects for word in ("--effect", label)]
    settings = resolved(artifact).get("identify") or {}
    if settings.get("method", IdentifySettings().method) != IdentifySettings().method:
        words += ["--method", settings["method"]]
    if settings.get("reversals"):
        words.append("--reversals")
    words += [*_config(session, artifact), "-o", _folder(artifact.path)]
    return ["identify", *runs, *words]


def _diagnose(session: Session, artifact: Artifact) -> list[str]:
    labels = (resolved(artifact).get("diagnose") or {}).get("known") or []
    known = [word for label in labels for word in ("--known", label)]
    words = ["diagnose", *_inputs(session, artifact), *known, *_config(session, artifact)]
    return [*words, "--out", _folder(artifact.path)]


def _simulate(session: Session, artifact: Artifact) -> list[str]:
    inputs = _inputs(session, artifact)
    kind = simulation_kind(artifact)
    if kind == "drives" or not inputs:
        return []  # Written together with the replay in windows.
    config = _config(session, artifact)
    if kind == "windows":
        words = ["simulate", inputs[0], "--replay", inputs[-1], *config]
        return [*words, "-o", str(artifact.path)]
    # The model is the first input, and a reference, if any, the second.
    reference = ["--reference", inputs[1]] if len(inputs) > 1 else []
    run = artifact.metadata.get("plant", {}).get("run", "with_human")
    option = [] if run == "with_human" else ["--run", run]
    words = ["simulate", inputs[0], *reference, *option, *config]
    return [*words, "-o", _folder(artifact.path)]
