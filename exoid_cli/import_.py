"""``exoid import``: make recordings of logs from other tools."""

import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import NAME
from pipelines.errors import ContractError, InputError

if TYPE_CHECKING:
    from pipelines.importing.finding import Finding
    from pipelines.importing.recordings import ImportedRecording
    from pipelines.settings.import_map import ImportMap


def import_(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="Logs: text, .mat, .tdms, .xlsx, .npz, Parquet, JSON, HDF5, MDF, ROS bags.",
        ),
    ],
    map_: Annotated[
        Path | None, typer.Option("--map", help="The map: what each column is, and in which unit.")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for the recordings.")
    ] = Path("recordings"),
    guess: Annotated[
        bool, typer.Option("--guess", help="Propose a map instead; written to --map, if given.")
    ] = False,
) -> None:
    """Make recordings of logs from other tools; a map says what their columns are.

    \b
    Examples:
      exoid import run1.csv run2.csv --guess --map machine.toml
      exoid import run1.csv run2.csv --map machine.toml -o recordings/
    """
    if guess:
        _propose(files, map_)
    elif map_ is None:
        raise InputError(
            "--map: missing; `exoid import FILE... --guess --map MAP.toml` proposes one"
        )
    else:
        _import(files, map_, output)


def _propose(files: list[Path], map_file: Path | None) -> None:
    from pipelines.contracts.atomic import write_text
    from pipelines.importing.guess.guess import propose

    if map_file is not None and map_file.exists():
        raise InputError(
            f"{map_file}: exists already, not overwritten with a guess; choose another name"
        )
    with console.working("guessing a map"):
        proposal = propose(files)
    doubts = [asdict(doubt) for doubt in proposal.doubts]
    console.emit({"map": proposal.text, "doubts": doubts})
    if map_file is None:
        console.say(proposal.text.rstrip())
        return
    write_text(map_file, proposal.text)
    console.say(
        f"{map_file}: proposed; check the doubtful entries, then"
        f" `exoid import ... --map {map_file}`"
    )
    for doubt in proposal.doubts:
        console.note(f"- {'fill in' if doubt.blocks else 'unsure'}: {doubt.key}: {doubt.why}")


def _import(files: list[Path], map_: Path, output: Path) -> None:
    # Most logs whose findings are all printed.
    few = 3
    from pipelines.contracts.atomic import folder_to_fill, leftovers
    from pipelines.importing.sanity.leftover_recordings import unused
    from pipelines.importing.sources.joined import firsts
    from pipelines.settings.import_map import load_map

    if output.suffix == ".parquet":
        raise InputError(
            f"-o {output}: is a file name, expected the folder of all recordings, such as"
            f' -o {output.parent}; name = "{output.stem}" at [[recording]] in the map names one'
        )
    settings = load_map(map_)
    files = firsts(files, settings.source.join)
    for leftover in leftovers(output) if output.is_dir() else []:
        console.warn(
            f"{leftover}: temporary file of an import that was killed or still runs; remove it"
            " if none runs"
        )
    with folder_to_fill(output):
        logs = _recordings(files, settings, map_, output)
    for recording in unused(settings, files):
        console.warn(f"{map_}: {recording}")
    if len(logs) > few:
        _say_in_short(logs)
    else:
        for log in logs:
            _say(log)
    console.emit(logs)
    names = [recording["path"].stem for log in logs for recording in log["recordings"]]
    _say_next_step(output, names, map_)


def _recordings(
    files: list[Path], settings: "ImportMap", map_: Path, output: Path
) -> list[dict[str, Any]]:
    """Write the recordings of all files, or none of them; describe each file."""
    from pipelines.contracts import RECORDING
    from pipelines.contracts.atomic import all_or_none
    from pipelines.importing.recordings import Begins, recordings

    sources: dict[Path, Path] = {}
    # One for all files, because counters are compared across logs.
    begins: Begins = {}
    logs: list[dict[str, Any]] = []
    with all_or_none(output) as folder:
        for file in files:
            written: list[dict[str, Any]] = []
            with console.working(f"reading {file.name}"):
                for recording in recordings(file, settings, map_, begins):
                    path = output / recording.file
                    # Asked before it is written, as the second recording would replace the first.
                    if path in sources:
                        raise InputError(_same_name(path, sources[path], file))
                    _refuse_to_overwrite(path)
                    RECORDING.write_pieces(
                        folder / recording.file, recording.pieces(), recording.metadata
                    )
                    sources[path] = file
                    written.append(_as_json(path, recording))
            logs.append({"file": file, "recordings": written})
    return logs


def _same_name(path: Path, first: Path, second: Path) -> str:
    """Say that two recordings have the same name, and which names differ."""
    if first.absolute() == second.absolute():
        remedy = "give the file once, or [[recording]] in the map names that differ"
    elif first.stem == second.stem:
        remedy = (
            "give [[recording]] in the map a name with {folder} in it, such as"
            ' "{folder}_{file}_{purpose}", or each file one of its own, files ='
            f' "{"/".join(second.absolute().parts[-2:])}"'
        )
    else:
        remedy = "give [[recording]] in the map names that differ, with {file} in them"
    return f"{second}: its recording {path} would replace that of {first}; {remedy}"


def _refuse_to_overwrite(path: Path) -> None:
    """Refuse to overwrite another file, or a recording that was not imported."""
    from pipelines.contracts import RECORDING
    from pipelines.contracts.provenance import metadata_of

    RECORDING.refuse_place(path)
    metadata = metadata_of(path)
    if metadata.get("contract") == RECORDING.label and "imported" not in metadata:
        raise ContractError(f"{path}: holds a recording that was not imported, not overwritten")


def _say_next_step(output: Path, names: list[str], map_: Path) -> None:
    from pipelines.importing.sanity.leftover_recordings import missing_for_verdict, outdated
    from pipelines.workflow.imported import imported_in

    imported = imported_in(output)
    for name in outdated(imported, names):
        console.warn(
            f"{output / name}: made of these logs with an earlier map, but not with this one;"
            " remove it"
        )
    problems = list(missing_for_verdict(imported, names, map_))
    for problem in problems:
        console.say(problem)
    # An exoid.toml next to the recordings makes the folder an experiment.
    settings_file = output.parent / NAME
    if not problems and not settings_file.exists():
        console.say(
            f"with an empty {settings_file.as_posix()} next to them, `exoid run` does the rest"
        )


def _say_in_short(logs: list[dict[str, Any]]) -> None:
    """Print a line for each log, then each kind of finding once, with its first numbers."""
    seen: dict[tuple[str, str], list[tuple[Finding, str]]] = {}
    for log in logs:
        for recording in log["recordings"]:
            _say_recording(recording)
        for finding in _findings(log):
            # Findings of one kind differ in their numbers only, as in "2 rows left out".
            words = re.sub(r"\d[\d.,  ]*", "#", str(finding).removeprefix(finding.where))
            seen.setdefault((finding.where, words), []).append((finding, log["file"].name))
    if seen:
        console.say("\nSeen, with the numbers of the first file; `exoid show` has those of each:")
    for of_kind in seen.values():
        finding, first = of_kind[0]
        files = len({name for _, name in of_kind})
        more = f" and {files - 1} more" if files > 1 else ""
        console.note(f"- {finding} ({first}{more})")
    console.say("")


def _say(log: dict[str, Any]) -> None:
    for recording in log["recordings"]:
        _say_recording(recording)
        begin, end = recording["span_s"]
        console.note(f"{begin:.3f} to {end:.3f} s of {log['file'].name}")
    for finding in _findings(log):
        console.note(f"- {finding}")


def _say_recording(recording: dict[str, Any]) -> None:
    console.say(
        f"{recording['path']}: {recording['purpose']}, {recording['samples']} samples,"
        f" {recording['sample_rate_hz']:.6g} Hz"
    )


def _findings(log: dict[str, Any]) -> "list[Finding]":
    """Return the findings in a log, each once."""
    from pipelines.importing.finding import Finding

    entries = (entry for recording in log["recordings"] for entry in recording["findings"])
    return list(dict.fromkeys(Finding.from_json(entry) for entry in entries))


def _as_json(path: Path, recording: "ImportedRecording") -> dict[str, Any]:
    time = recording.columns["time_s"]
    return {
        "path": path,
        "samples": len(recording),
        "sample_rate_hz": recording.metadata["sample_rate_hz"],
        "purpose": recording.metadata["purpose"],
        "span_s": [float(time[0]), float(time[-1])],
        "gaps": recording.metadata["gaps"],
        "findings": recording.metadata["imported"]["findings"],
    }
