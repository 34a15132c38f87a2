"""Output to a terminal that may be closed: what nobody can read any more is dropped, and nothing
fails for that."""

import errno
import io
import os
import sys
from typing import Any


class Terminal(io.FileIO):
    """The file of a terminal; writing to it succeeds, whatever has become of the terminal."""

    def write(self, data: Any) -> int:
        """Write what there is, or nothing where the terminal is gone."""
        try:
            return super().write(data)
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return memoryview(data).nbytes


def outlast_terminals() -> None:
    """Let standard output and error, where they are terminals, be written to for as long as the
    process lives."""
    if os.name == "nt":
        return  # a console there is no file, and its end ends the process
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and stream.isatty():
            raw = Terminal(stream.fileno(), "w", closefd=False)
            setattr(
                sys,
                name,
                io.TextIOWrapper(io.BufferedWriter(raw), encoding="utf-8", line_buffering=True),
            )
