"""Ctrl-C that nobody hears: it came while compiled code called Python back, as the compiler does, which then fails."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from pipelines.errors import ExoidError


@contextmanager
def interrupts_told() -> Iterator[None]:
    """Raise KeyboardInterrupt where a failure within the block came after one that could be raised to nobody."""
    lost, before = False, sys.unraisablehook

    def hear(unraisable: "sys.UnraisableHookArgs") -> None:
        nonlocal lost
        if unraisable.exc_type is KeyboardInterrupt:
            lost = True
        else:
            before(unraisable)

    sys.unraisablehook = hear
    try:
        yield
    except (ExoidError, OSError):  # what these say is true nevertheless
        raise
    except Exception as error:
        if lost:
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = before
