"""``exoid import``: recordings out of logs from elsewhere."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exoid_cli.console import console
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.importing.recordings import Imported


def import_(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE", help="Logs: CSV, .mat, Parquet, JSON, HDF5, MCAP, ROS 2 bags.")
    ],
    map_: Annotated[Path | None, typer.Option("--map", help="The map: what each column is, and in which unit.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the recordings.")] = Path("recordings"),
    guess: Annotated[
        bool, typer.Option("--guess", help="Propose a map instead; into the file that --map names, if any.")
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
        raise InputError("--map: missing; `exoid import FILE... --guess --map MAP.toml` proposes one")
    else:
        _import(files, map_, output)


def _propose(files: list[Path], place: Path | None) -> None:
    from pipelines.contracts.atomic import write_text
    from pipelines.importing.guess.guess import propose

    if place is not None and place.exists():
        raise InputError(f"{place}: exists already, not overwritten with a guess; choose another name")
    with console.working("looking"):
        proposal = propose(files)
    doubts = [asdict(doubt) for doubt in proposal.doubts]
    console.emit({"map": proposal.text, "doubts": doubts})
    if place is None:
        console.say(proposal.text.rstrip())
        return
    write_text(place, proposal.text)
    console.say(f"{place}: proposed; look at what is doubtful in it, then `exoid import ... --map {place}`")
    for doubt in proposal.doubts:
        console.note(f"- {'fill in' if doubt.blocks else 'unsure'}: {doubt.key}: {doubt.why}")


def _import(files: list[Path], map_: Path, output: Path) -> None:
    from pipelines.contracts.atomic import open_folder
    from pipelines.importing.recordings import recordings
    from pipelines.settings.import_map import load_map

    settings = load_map(map_)
    open_folder(output)
    written: dict[Path, Path] = {}
    told: list[dict[str, Any]] = []
    for file in files:
        made = []
        with console.working(f"reading {file.name}"):
            found = list(recordings(file, settings, map_))  # all are right before the first is written
        for recording in found:
            path = output / f"{recording.name}.parquet"
            if path in written:
                raise InputError(
                    f"{file}: its recording {path} would replace that of {written[path]}; "
                    "give [[recording]] in the map names that differ, with {file} in them"
                )
            made.append((recording.write(output), recording))
            written[path] = file
        _say(file, made)
        told.append(_as_json(file, made))
    console.emit(told)


def _say(file: Path, made: list[tuple[Path, "Imported"]]) -> None:
    for path, recording in made:
        count = len(recording)
        time, purpose = recording.columns["time_s"], recording.metadata["purpose"]
        span = f"{time[0]:.3f} to {time[-1]:.3f} s of {file.name}"
        console.say(f"{path}: {purpose}, {count} samples, {recording.sampling.rate_hz:.6g} Hz")
        console.note(span)
    for finding in dict.fromkeys(finding for _, recording in made for finding in recording.findings):
        console.note(f"- {finding}")


def _as_json(file: Path, made: list[tuple[Path, "Imported"]]) -> dict[str, Any]:
    return {
        "file": file,
        "recordings": [
            {"path": path, "samples": len(recording), "sample_rate_hz": recording.sampling.rate_hz,
             "purpose": recording.metadata["purpose"], "gaps": recording.metadata["gaps"],
             "findings": recording.metadata["imported"]["findings"]}
            for path, recording in made
        ],
    }  # fmt: skip
