"""``exoid import``: recordings out of logs from elsewhere."""

import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from exoid_cli.place import NAME
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.importing.finding import Finding
    from pipelines.importing.recordings import Imported
    from pipelines.settings.import_map import ImportMap

FEW = 3
"""Logs of which each is told with all that was seen in it."""


def import_(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE", help="Logs: CSV, .mat, Parquet, JSON, HDF5, MCAP, ROS 2 bags."
        ),
    ],
    map_: Annotated[
        Path | None, typer.Option("--map", help="The map: what each column is, and in which unit.")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for the recordings.")
    ] = Path("recordings"),
    guess: Annotated[
        bool,
        typer.Option(
            "--guess", help="Propose a map instead; into the file that --map names, if any."
        ),
    ] = False,
) -> None:
    """Make recordings of logs from elsewhere; a map says what their columns are.

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


def _propose(files: list[Path], place: Path | None) -> None:
    from pipelines.contracts.atomic import write_text
    from pipelines.importing.guess.guess import propose

    if place is not None and place.exists():
        raise InputError(
            f"{place}: exists already, not overwritten with a guess; choose another name"
        )
    with console.working("looking"):
        proposal = propose(files)
    doubts = [asdict(doubt) for doubt in proposal.doubts]
    console.emit({"map": proposal.text, "doubts": doubts})
    if place is None:
        console.say(proposal.text.rstrip())
        return
    write_text(place, proposal.text)
    console.say(
        f"{place}: proposed; look at what is doubtful in it, then `exoid import ... --map {place}`"
    )
    for doubt in proposal.doubts:
        console.note(f"- {'fill in' if doubt.blocks else 'unsure'}: {doubt.key}: {doubt.why}")


def _import(files: list[Path], map_: Path, output: Path) -> None:
    from pipelines.contracts.atomic import folder_to_fill, leftovers
    from pipelines.importing.sanity.leftover_recordings import unused
    from pipelines.settings.import_map import load_map

    _refuse_the_name_of_a_recording(output)
    settings = load_map(map_)
    for left in leftovers(output) if output.is_dir() else []:
        console.warn(
            f"{left}: left by an import that was killed, or of one that goes on; remove it once"
            " none does"
        )
    with folder_to_fill(output):
        told = _made(files, settings, map_, output)
    for recording in unused(settings, files):
        console.warn(f"{map_}: {recording}")
    if len(told) > FEW:
        _say_in_short(told)
    else:
        for one in told:
            _say(one)
    console.emit(told)
    _say_what_follows(
        output, [made["path"].stem for one in told for made in one["recordings"]], map_
    )


def _refuse_the_name_of_a_recording(output: Path) -> None:
    if output.suffix == ".parquet":
        raise InputError(
            f"-o {output}: ends as a recording's file does, expected the folder for all of them,"
            " such as "
            f'-o {output.parent}; name = "{output.stem}" at [[recording]] in the map names one'
        )


def _made(
    files: list[Path], settings: "ImportMap", map_: Path, output: Path
) -> list[dict[str, Any]]:
    """Write the recordings of all files, or none of them; return what is told of each file."""
    from pipelines.contracts.atomic import all_or_none
    from pipelines.importing.quantities.turn_offset import Beginnings
    from pipelines.importing.recordings import recordings, refuse_to_overwrite

    sources: dict[Path, Path] = {}
    before = Beginnings()
    told: list[dict[str, Any]] = []
    with all_or_none(output) as folder:
        for file in files:
            made: list[dict[str, Any]] = []
            with console.working(f"reading {file.name}"):
                for recording in recordings(file, settings, map_, before):
                    path = output / recording.file
                    if path in sources:
                        raise InputError(_twice(path, sources[path], file))
                    refuse_to_overwrite(path)
                    recording.write(folder)
                    sources[path] = file
                    made.append(_as_json(path, recording))
            told.append({"file": file, "recordings": made})
    return told


def _twice(path: Path, first: Path, second: Path) -> str:
    """Say that two recordings have one name, and which names would differ."""
    if first.absolute() == second.absolute():
        what = "give the file once, or [[recording]] in the map names that differ"
    elif first.stem == second.stem:
        what = (
            "give [[recording]] in the map a name with {folder} in it, such as"
            ' "{folder}_{file}_{purpose}", or each file one of its own, files ='
            f' "{"/".join(second.absolute().parts[-2:])}"'
        )
    else:
        what = "give [[recording]] in the map names that differ, with {file} in them"
    return f"{second}: its recording {path} would replace that of {first}; {what}"


def _say_what_follows(output: Path, made: list[str], map_: Path) -> None:
    from pipelines.importing.sanity.leftover_recordings import lacks, no_longer_made
    from pipelines.workflow.imported import imported_in

    found = imported_in(output)
    for name in no_longer_made(found, made):
        console.warn(
            f"{output / name}: of these logs too, by an earlier map; this one makes it no more,"
            " remove it"
        )
    lacking = list(lacks(found, made, map_))
    for one in lacking:
        console.say(one)
    settings_file = output.parent / NAME
    if not lacking and not settings_file.exists():
        console.say(
            f"with an empty {settings_file.as_posix()} beside them, `exoid run` does the rest"
        )


def _say_in_short(told: list[dict[str, Any]]) -> None:
    """Say of many logs a line each, and then once what was seen in several, but for its numbers."""
    seen: dict[tuple[str, str], list[tuple[Finding, str]]] = {}
    for one in told:
        for made in one["recordings"]:
            _say_what_was_made(made)
        for finding in _findings(one):
            # As in "2 rows left out": of another file the numbers are others.
            kind = (
                finding.where,
                re.sub(r"\d[\d.,  ]*", "#", str(finding).removeprefix(finding.where)),
            )
            seen.setdefault(kind, []).append((finding, one["file"].name))
    if seen:
        console.say("\nSeen, with the numbers of the first file; `exoid show` tells those of each:")
    for found in seen.values():
        finding, first = found[0]
        files = len({name for _, name in found})
        more = f" and {files - 1} more" if files > 1 else ""
        console.note(f"- {finding} ({first}{more})")
    console.say("")


def _say(told: dict[str, Any]) -> None:
    for made in told["recordings"]:
        _say_what_was_made(made)
        console.note(f"{made['span_s'][0]:.3f} to {made['span_s'][1]:.3f} s of {told['file'].name}")
    for finding in _findings(told):
        console.note(f"- {finding}")


def _say_what_was_made(made: dict[str, Any]) -> None:
    console.say(
        f"{made['path']}: {made['purpose']}, {made['samples']} samples,"
        f" {made['sample_rate_hz']:.6g} Hz"
    )


def _findings(told: dict[str, Any]) -> "list[Finding]":
    """Return what was seen in a log, once where it is of all its recordings."""
    from pipelines.importing.finding import Finding

    return list(
        dict.fromkeys(Finding(**found) for made in told["recordings"] for found in made["findings"])
    )


def _as_json(path: Path, recording: "Imported") -> dict[str, Any]:
    time = recording.columns["time_s"]
    return {
        "path": path,
        "samples": len(recording),
        "sample_rate_hz": recording.sampling.rate_hz,
        "purpose": recording.metadata["purpose"],
        "span_s": [float(time[0]), float(time[-1])],
        "gaps": recording.metadata["gaps"],
        "findings": recording.metadata["imported"]["findings"],
    }
