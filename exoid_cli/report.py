"""``exoid report``: all results on one page that opens offline."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.report.session import Session

FoldersArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="DIR", help="Folders that the stages wrote to.", show_default="this one"
    ),
]


def report(
    folders: FoldersArgument = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="The page to write.")] = Path(
        "report.html"
    ),
    config: Annotated[
        Path | None,
        typer.Option(help="exoid.toml, named in the command lines that repeat the work."),
    ] = None,
    compare: Annotated[
        tuple[Path, Path] | None, typer.Option(metavar="A B", help="Lay two sessions side by side.")
    ] = None,
    title: Annotated[
        str | None, typer.Option(help="The page's title; the folder's name unless given.")
    ] = None,
) -> None:
    """Write one self-contained page: verdict, figures, model, and how to repeat the work.

    \b
    Examples:
      exoid report
      exoid report build/default -o report.html
      exoid report --compare monday/ tuesday/ -o compared.html
    """
    from pipelines.contracts.atomic import write_text
    from pipelines.errors import SettingsError
    from pipelines.report.html.report import report as page_of
    from pipelines.report.session import find

    if output.is_dir():
        raise SettingsError(
            f"-o {output}: is a folder, expected the name of a page; write {output / 'report.html'}"
        )
    if compare:
        if folders:
            raise SettingsError(
                "--compare names both its folders itself; drop the others, or --compare"
            )
        _compare(compare, output)
        return
    session = find(folders or [Path()], config)
    with console.working("writing the page"):
        page = page_of(session, title, output)
    write_text(output, page)
    # After the page is written: a damaged file leaves a hole, which is no reason to fail.
    warn_of_unreadable(session)
    summary = session.verdict.summary if session.verdict else None
    console.emit({"path": str(output), "bytes": len(page.encode()), "summary": summary})
    if summary:
        console.say(summary)
    console.say(f"{output}: {len(page.encode()) / 1e6:.1f} MB, opens in any browser")


def warn_of_unreadable(session: "Session") -> None:
    """Warn of each exoid file that cannot be read."""
    for warning in session.unreadable.values():
        console.warn(warning)


def _compare(folders: tuple[Path, Path], output: Path) -> None:
    from pipelines.contracts.atomic import write_text
    from pipelines.report.html.compare import compare, titles_of
    from pipelines.report.session import find

    first, second = (find([folder]) for folder in folders)
    for session in (first, second):
        warn_of_unreadable(session)
    page = compare(first, second, titles_of(first, second))
    write_text(output, page.text)
    counts = {"changed": page.changed, "judged": page.judged, "headline": page.headline}
    settings = [asdict(one) for one in page.settings]
    console.emit({"path": str(output)} | counts | {"settings": settings})
    console.say(f"{page.headline}{' (95 %)' if page.judged else ''}.")
    for line in page.errors:
        console.say(line)
    for one in page.settings:
        console.say(f"{one.name}: {one.first} → {one.second}")
    console.say(f"{output}: opens in any browser")
