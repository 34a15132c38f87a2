"""The person at the leg, at a terminal."""

import asyncio
import sys

from exoid_cli.console import console
from pipelines.errors import InputError


class Terminal:
    """Tells what to do and waits for Enter."""

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise InputError(
                "--by-hand asks a person what to do, but standard input is no terminal; run it"
                " in one"
            )

    async def ready(self, prompt: str) -> None:
        """Show a prompt and return once Enter is pressed; Ctrl-C goes through meanwhile."""
        console.err.print(f"\n{prompt}\nPress Enter when you begin.", markup=False)
        entered, loop = asyncio.Event(), asyncio.get_running_loop()
        loop.add_reader(sys.stdin, entered.set)
        try:
            await entered.wait()
        finally:
            loop.remove_reader(sys.stdin)
        if not sys.stdin.readline():
            raise InputError(
                "standard input ended before the check did; begin it anew at a terminal"
            )
