"""Terminal output: text and tables, progress, or, with ``--json``, one JSON document on stdout.

A command calls ``say`` and ``table`` for people and ``emit`` for programs, whoever reads: ``say``
prints nothing under ``--json``, and ``emit`` nothing without it. rich is imported when something
is printed, so that `exoid --help` starts fast.
"""

import json
import math
import shlex
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cached_property
from pathlib import Path
from textwrap import TextWrapper
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from rich.console import Console as RichConsole
    from rich.console import RenderableType
    from rich.text import Text


class Console:
    """The terminal of one invocation; results go to stdout, progress and warnings to stderr."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the options and warnings of an earlier invocation."""
        self.quiet = self.json = False
        self._gathered: list[Any] | None = None
        self._warned = set[str]()
        # Cached properties: the next invocation may have other streams.
        for name in ("out", "err"):
            self.__dict__.pop(name, None)

    @cached_property
    def out(self) -> "RichConsole":
        """Standard output."""
        from rich.console import Console as RichConsole

        return RichConsole(highlight=False)

    @cached_property
    def err(self) -> "RichConsole":
        """Standard error."""
        from rich.console import Console as RichConsole

        return RichConsole(stderr=True, highlight=False)

    def add_options(self, *, quiet: bool, json: bool) -> None:
        """Switch on the global options that are given; those given before stay on."""
        self.quiet |= quiet
        self.json |= json

    @property
    def speaks(self) -> bool:
        """Whether text for people is printed."""
        return not (self.quiet or self.json)

    def say(self, text: "str | Text") -> None:
        """Print a sentence of result for a person."""
        if self.speaks:
            # Wrapped on a terminal only: a pipe, and a search in it, needs lines as they are.
            self.out.print(_as_text(text), soft_wrap=not self.out.is_terminal)

    def note(self, text: str) -> None:
        """Print a remark on the line above, indented and broken between words."""
        wrapper = TextWrapper(self.out.width, "  ", "    " if text.startswith("- ") else "  ")
        wrapper.break_long_words = wrapper.break_on_hyphens = False
        for line in wrapper.wrap(text):
            self.say(line)

    def wrote(self, folder: Path, *names: str) -> None:
        """Print the files that were written into a folder, after the results."""
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
        """Print a table; headings named in ``numbers`` (comma-separated) are set to the right."""
        if not self.speaks:
            return
        from rich.table import Table
        from rich.text import Text

        from exoid_cli.column_widths import break_at_slashes, column_widths

        right = {name.strip() for name in numbers.split(",") if name.strip()}
        if title:
            self.say(Text(title, style="bold"))
        cells = [["" if cell is None else str(cell) for cell in row] for row in rows]
        widths = column_widths(headings, cells, self.out.width)
        table = Table(box=None, pad_edge=False)
        for heading, width in zip(headings, widths, strict=True):
            justify: Literal["left", "right"] = "right" if heading in right else "left"
            table.add_column(heading, justify=justify, overflow="fold", width=width)
        for row in cells:
            broken = (
                text if width is None else break_at_slashes(text, width)
                for text, width in zip(row, widths, strict=True)
            )
            table.add_row(*map(Text, broken))
        with self.out.capture() as captured:
            self.out.print(table)
        # rich pads the last column with spaces, which would be copied with the text.
        self.out.file.write("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))

    def emit(self, data: Any) -> None:
        """Print a result for a program, if ``--json`` is given."""
        if self._gathered is not None:
            self._gathered.append(data)
        elif self.json:
            print(json.dumps(_plain(data), ensure_ascii=False, indent=2, allow_nan=False))

    @contextmanager
    def gathering(self) -> Iterator[list[Any]]:
        """Collect the block's output, so that several commands can print one document."""
        before, self._gathered = self._gathered, []
        try:
            yield self._gathered
        finally:
            self._gathered = before

    def say_command(self, words: Sequence[str], why: str) -> None:
        """Print a command that is about to run, as a shell takes it, and the reason."""
        if self.speaks:
            # On one line, to be copied in one piece.
            self.out.print(_as_text(shlex.join(words), "bold"), soft_wrap=True)
            if why:
                self.note(why)

    def warn(self, text: str) -> None:
        """Print a warning in every mode; the same warning only once."""
        if text in self._warned:
            return
        self._warned.add(text)
        self.err.print(_as_text(f"warning: {text}", "yellow"), soft_wrap=True)

    def fail(self, text: str) -> None:
        """Print an error as one line."""
        self.err.print(_as_text(f"exoid: {' '.join(text.split())}", "red"), soft_wrap=True)

    @contextmanager
    def progress(self, what: str, total: float | None) -> Iterator[Callable[..., None]]:
        """Show a bar, or a spinner without a total; yield ``report(done, note="")``."""
        if not self._may_move:
            yield lambda done, note="": None
            return
        from rich import progress as rich

        words, elapsed = rich.TextColumn("{task.description}"), rich.TimeElapsedColumn()
        columns: list[Any] = [rich.SpinnerColumn("line"), words, elapsed]
        if total is not None:
            note = rich.TextColumn("{task.fields[note]}")
            columns = [words, rich.BarColumn(), note, elapsed, rich.TimeRemainingColumn()]
        with rich.Progress(*columns, console=self.err, transient=True) as bar:
            task = bar.add_task(what, total=total, note="")
            yield lambda done, note="": bar.update(task, completed=done, note=note)

    def working(self, what: str) -> AbstractContextManager[Any]:
        """Show a spinner and the elapsed time while the block runs."""
        return self.progress(what, None)

    @contextmanager
    def starting(self, what: str, late_s: float = 5.0) -> Iterator[None]:
        """Show the task that is being started; without a terminal, print it after ``late_s``."""
        late = threading.Timer(late_s, lambda: self.err.print(_as_text(what), soft_wrap=True))
        late.daemon = True
        # On a terminal the spinner says it already.
        if self.speaks and not self._may_move:
            late.start()
        try:
            with self.working(what):
                yield
        finally:
            late.cancel()

    @contextmanager
    def live(self, picture: "RenderableType") -> Iterator[None]:
        """Keep a picture on the terminal while the block runs, drawn ten times a second.

        The last picture is printed below the earlier output.
        """
        if not self._may_move:
            yield
            return
        from rich.live import Live

        interval = sys.getswitchinterval()
        # Longest time that drawing a live picture may delay other threads, s.
        sys.setswitchinterval(0.0005)
        try:
            # On the alternate screen, so that the picture survives a resized window.
            with Live(picture, console=self.err, screen=True, refresh_per_second=10):
                yield
        finally:
            sys.setswitchinterval(interval)
            self.err.print(picture)

    @property
    def _may_move(self) -> bool:
        return self.speaks and self.err.is_terminal


def _as_text(text: "str | Text", style: str = "") -> "Text":
    """Return a text that rich prints as it is, without markup."""
    from rich.text import Text

    return Text(text, style=style) if isinstance(text, str) else text


def _plain(value: Any) -> Any:
    """Return a value in JSON's types; NaN and infinity become null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    # JSON has no NaN; float() also turns numpy's scalar into Python's.
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    return _plain(value.tolist()) if hasattr(value, "tolist") else str(value)


console = Console()
