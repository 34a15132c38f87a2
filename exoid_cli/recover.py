"""``exoid recover``: make a whole recording of a killed run's journal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.acquisition.recording.recover import Recovery


def recover(
    journals: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOURNAL",
            help="Journals of killed runs, or folders of them.",
            show_default="recordings/",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The recording of one JOURNAL."),
    ] = None,
) -> None:
    """Make a recording of a killed run's journal, and say what is missing.

    The journal is removed once the recording is written, unless it is damaged. No file is
    overwritten.

    \b
    Examples:
      exoid recover
      exoid recover recordings/with_human_train.parquet.journal
    """
    from pipelines.acquisition.recording.recover import Recovery, journals_in
    from pipelines.acquisition.recording.recover import recover as make_recording

    if not journals:
        folder = open_experiment(None, problem="no journal is given", allow_damaged=True).out
        journals = [path for path in [folder / "recordings"] if path.exists()]
    files = [file for path in journals for file in journals_in(path)]
    if not files:
        console.say("no killed run left a journal; nothing to recover")
    if output and len(files) > 1:
        raise InputError(
            f"-o: names one recording, but there are {len(files)} journals; leave it out"
        )
    recovered, refused = list[Recovery](), list[InputError]()
    for file in files:
        try:
            with console.working(f"recovering {file.name}"):
                recovered.append(make_recording(file, output))
            console.say(_in_words(recovered[-1]))
        # A useless journal must not keep the others from being recovered.
        except InputError as error:
            refused.append(error)
    console.emit([_as_json(recording) for recording in recovered])
    # All are reported; the last one is raised, and makes the exit code.
    for refusal in refused[:-1]:
        console.fail(str(refusal))
    if refused:
        raise refused[-1]


def _in_words(recording: "Recovery") -> str:
    summary = recording.summary
    text = f"{recording.path}: {summary.samples} samples"
    if summary.cut_off:
        seconds = summary.cut_off / summary.rate_hz
        text += f"; {summary.cut_off} more ({seconds:.3f} s) were planned"
    gaps = (
        f"{summary.missed} are missing in {len(summary.gaps)} gaps" if summary.gaps else "no gaps"
    )
    text += f"; {gaps}"
    if summary.damaged:
        text += "; the journal is damaged or cut off, and is kept: check the disk"
    return (
        f"{text}; {summary.abort or 'the run was complete, but its recording had not been written'}"
    )


def _as_json(recording: "Recovery") -> dict:
    keys = ("samples", "planned", "cut_off", "gaps", "abort", "damaged")
    summary = {key: getattr(recording.summary, key) for key in keys}
    # Every journal has checksums; programs that read this JSON expect the key.
    return {"path": recording.path} | summary | {"checked": True}
