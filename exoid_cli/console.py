"""What the user sees: text and tables, progress, or, with ``--json``, one JSON document on stdout.

A command calls ``say`` and ``table`` for people and ``emit`` for programs, without asking which of
them listens: people's output is silent under ``--json``, and ``emit`` is silent without it.
"""

import json
import math
import shlex
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from typing import Any

from rich.console import Console as RichConsole
from rich.console import RenderableType
from rich.live import Live
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from exoid_cli.column_widths import at_slashes, columns

DRAWING_S = 0.0005
"""How long the drawing of a live picture may hold up the work that it tells of."""
LATE_S = 5.0
"""After this long somebody who sees nothing move wonders whether anything goes on."""


class Console:
    """The terminal of one invocation; results go to stdout, progress and warnings to stderr."""

    def __init__(self) -> None:
        self.configure()

    def configure(self, *, quiet: bool = False, json: bool = False) -> None:
        """Set what the global options ask for."""
        self.quiet = quiet
        self.json = json
        self._gathered: list[Any] | None = None
        self._warned = set[str]()
        self.out = RichConsole(highlight=False)
        self.err = RichConsole(stderr=True, highlight=False)

    def heed(self, *, quiet: bool, json: bool) -> None:
        """Take notice of the global options where a command was given them; what was asked for
        before stays."""
        self.quiet |= quiet
        self.json |= json

    @property
    def speaks(self) -> bool:
        """Whether a person reads along."""
        return not (self.quiet or self.json)

    def say(self, text: str | Text) -> None:
        """Print a sentence of result for a person."""
        if self.speaks:
            # A terminal would break words; a pipe, and whoever searches in it, wants lines as they
            # are.
            self.out.print(
                text if isinstance(text, Text) else Text(text), soft_wrap=not self.out.is_terminal
            )

    def note(self, text: str) -> None:
        """Print what is to be said of the line above, set in and broken between words."""
        hanging = "    " if text.startswith("- ") else "  "
        for line in wrap(
            text,
            self.out.width,
            initial_indent="  ",
            subsequent_indent=hanging,
            break_long_words=False,
            break_on_hyphens=False,
        ):
            self.say(line)

    def wrote(self, folder: Path, *names: str) -> None:
        """Print what was written into a folder, after the results."""
        self.say("")
        self.say(f"{folder.as_posix()}/:")
        self.note(", ".join(names))

    def table(
        self,
        headings: Sequence[str],
        rows: Iterable[Sequence[Any]],
        *,
        title: str | None = None,
        numbers: str = "",
    ) -> None:
        """Print a table for a person; headings named in ``numbers`` (comma-separated) are set to
        the right."""
        if not self.speaks:
            return
        right = {name.strip() for name in numbers.split(",") if name.strip()}
        if title:
            self.say(Text(title, style="bold"))
        cells = [["" if cell is None else str(cell) for cell in row] for row in rows]
        widths = columns(headings, cells, self.out.width)
        table = Table(box=None, pad_edge=False)
        for heading, width in zip(headings, widths, strict=True):
            table.add_column(
                heading,
                justify="right" if heading in right else "left",
                overflow="fold",
                width=width,
            )
        for row in cells:
            table.add_row(
                *(
                    Text(text if width is None else at_slashes(text, width))
                    for text, width in zip(row, widths, strict=True)
                )
            )
        with self.out.capture() as captured:
            self.out.print(table)
        # The last column is filled up with spaces, which nobody wants who copies from it.
        self.out.file.write("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))

    def emit(self, data: Any) -> None:
        """Print a result for a program, where ``--json`` asked for it."""
        if self._gathered is not None:
            self._gathered.append(data)
        elif self.json:
            print(
                json.dumps(_plain(data), ensure_ascii=False, indent=2, allow_nan=False),
                file=sys.stdout,
            )

    @contextmanager
    def gathering(self) -> Iterator[list[Any]]:
        """Keep what is emitted in the block, so that several commands can make one document."""
        before, self._gathered = self._gathered, []
        try:
            yield self._gathered
        finally:
            self._gathered = before

    def say_command(self, words: Sequence[str], why: str) -> None:
        """Print a command that is about to be called, as a shell would take it, and why."""
        if self.speaks:
            # To be copied in one piece.
            self.out.print(Text(shlex.join(words), style="bold"), soft_wrap=True)
            if why:
                self.note(why)

    def warn(self, text: str) -> None:
        """Print a warning, in every mode; once, where several steps have the same to say."""
        if text in self._warned:
            return
        self._warned.add(text)
        self.err.print(Text(f"warning: {text}", style="yellow"), soft_wrap=True)

    def fail(self, text: str) -> None:
        """Print the one line that an error is."""
        self.err.print(Text(f"exoid: {' '.join(text.split())}", style="red"), soft_wrap=True)

    @contextmanager
    def progress(self, what: str, total: float) -> Iterator[Callable[..., None]]:
        """Show a bar while the block runs; yields ``report(done, note="")`` with ``done`` out of
        ``total``."""
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[note]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        with Progress(
            *columns, console=self.err, transient=True, disable=not self._may_move
        ) as bar:
            task = bar.add_task(what, total=total, note="")
            yield lambda done, note="": bar.update(task, completed=done, note=note)

    @contextmanager
    def working(self, what: str) -> Iterator[None]:
        """Show that something goes on that may take a while, and for how long, where its end cannot
        be told."""
        columns = (SpinnerColumn("line"), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(
            *columns, console=self.err, transient=True, disable=not self._may_move
        ) as line:
            line.add_task(what, total=None)
            yield

    @contextmanager
    def starting(self, what: str) -> Iterator[None]:
        """Show what is being started; where nothing moves, a line says so as soon as it takes
        long."""
        late = threading.Timer(LATE_S, lambda: self.err.print(Text(what), soft_wrap=True))
        late.daemon = True
        if self.speaks and not self._may_move:
            late.start()
        try:
            with self.working(what):
                yield
        finally:
            late.cancel()

    @contextmanager
    def live(self, picture: RenderableType) -> Iterator[None]:
        """Keep a picture on the terminal while the block runs, drawn ten times a second by a thread
        of its own.

        It has the screen for itself, so that it is right after the window's size has changed; how
        it looked last stays below what was there before.
        """
        if not self._may_move:
            yield
            return
        interval = sys.getswitchinterval()
        sys.setswitchinterval(DRAWING_S)
        try:
            with Live(picture, console=self.err, screen=True, refresh_per_second=10):
                yield
        finally:
            sys.setswitchinterval(interval)
            self.err.print(picture)

    @property
    def _may_move(self) -> bool:
        return self.speaks and self.err.is_terminal


def _plain(value: Any) -> Any:
    """Return what JSON has words for; it has none for NaN and infinity, so that a number that is
    none is null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(below) for key, below in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(below) for below in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    return _plain(value.tolist()) if hasattr(value, "tolist") else str(value)


console = Console()
