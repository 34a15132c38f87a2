"""Output to a terminal that may be closed: nothing is printed then, and nothing fails."""

import errno
import io
import os
import sys
from typing import Any


class DetachableTerminal(io.FileIO):
    """A terminal's file to which writing succeeds even after the terminal was closed."""

    def write(self, data: Any) -> int:
        """Write the data, or drop them if the terminal was closed."""
        try:
            return super().write(data)
        except OSError as error:
            # EIO is what a write to a closed terminal returns; a full disk must still fail.
            if error.errno != errno.EIO:
                raise
            return memoryview(data).nbytes


def tolerate_closed_terminals() -> None:
    """Keep standard output and error writable after their terminal was closed."""
    if os.name == "nt":
        return  # a console there is no file, and closing it ends the process
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        # Files and pipes keep their errors, as their output would be incomplete.
        if stream is not None and stream.isatty():
            raw = DetachableTerminal(stream.fileno(), "w", closefd=False)
            buffer = io.BufferedWriter(raw)
            text = io.TextIOWrapper(buffer, encoding="utf-8", line_buffering=True)
            setattr(sys, name, text)
