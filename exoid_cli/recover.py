"""``exoid recover``: a whole recording of what a killed run left."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console
from exoid_cli.place import place_of
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.acquisition.recording.recover import Recovered


def recover(
    journals: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOURNAL",
            help="Journals that killed runs left, or folders of them.",
            show_default="recordings/",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The recording to write, of one.")
    ] = None,
) -> None:
    """Make a whole recording of what a killed run left, and say what is missing.

    The journal goes once the recording is written. A file that is there is never overwritten.

    \b
    Examples:
      exoid recover
      exoid recover recordings/with_human_train.parquet.journal
    """
    from pipelines.acquisition.recording.recover import journals_in
    from pipelines.acquisition.recording.recover import recover as make_recording

    recordings = (
        []
        if journals
        else [place_of(None, lacking="no journal is given", look_only=True).out / "recordings"]
    )
    places = journals or [folder for folder in recordings if folder.exists()]
    found = [journal for place in places for journal in journals_in(place)]
    if not found:
        console.say("no killed run left a journal; nothing to recover")
    if output and len(found) > 1:
        raise InputError(
            f"-o: names one recording, but there are {len(found)} journals; leave it out"
        )
    made, refused = [], list[InputError]()
    for journal in found:
        try:
            with console.working(f"recovering {journal.name}"):
                made.append(make_recording(journal, output))
            console.say(_told(made[-1]))
        # One that is of no use must not keep the others from being recovered.
        except InputError as error:
            refused.append(error)
    console.emit([_as_json(one) for one in made])
    for refusal in refused[:-1]:
        console.fail(str(refusal))
    if refused:
        raise refused[-1]


def _told(one: "Recovered") -> str:
    account, text = one.account, f"{one.path}: {one.account.samples} samples"
    if account.cut_off:
        seconds = account.cut_off / account.rate_hz
        text += f"; {account.cut_off} more ({seconds:.3f} s) were planned"
    text += (
        f"; {account.missed} are missing in {len(account.gaps)} gaps"
        if account.gaps
        else "; no gaps"
    )
    if account.damaged:
        text += "; the journal is damaged or cut off, and is kept: check the disk"
    if not account.checked:
        text += "; its numbers were not checked, an older exoid wrote it without checksums"
    return f"{text}; {account.abort or 'the run had ended, only its recording was not written'}"


def _as_json(one: "Recovered") -> dict:
    account = one.account
    return {
        "path": one.path,
        "samples": account.samples,
        "planned": account.planned,
        "cut_off": account.cut_off,
        "gaps": account.gaps,
        "abort": account.abort,
        "damaged": account.damaged,
        "checked": account.checked,
    }
