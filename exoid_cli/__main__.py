"""The entry of exoid: whatever asks it to end while Python still loads what it is made of ends it
in one line, too."""

import gc
import os
import signal

EARLY = {"SIGINT": "Ctrl-C", "SIGTERM": "SIGTERM"}
"""Signals that are heeded from the first on, and what a user calls them; by the others the system
ends exoid."""


COLLECT_AFTER = 50_000
"""New objects after which Python looks for those that are no longer used."""

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Where numpy's libraries read how many threads to use. exoid's matrices are small: threads that
wait for one another gain nothing alone, and take the processor from other commands."""


def _end(number: int, frame: object) -> None:
    # Nothing is to be cleared away yet, and an exception would be taken for an import's own
    # failure.
    os.write(2, f"exoid: stopped by {EARLY[signal.Signals(number).name]}\n".encode())
    os._exit(128 + number)


def main() -> None:
    """Run exoid as the shell's command."""
    for name in EARLY:
        if signal.getsignal(number := signal.Signals[name]) is not signal.SIG_IGN:
            signal.signal(number, _end)
    for name in THREADS:
        os.environ.setdefault(name, "1")
    # Loading makes many objects that stay: to look through them again and again takes a fifth of
    # it.
    gc.set_threshold(COLLECT_AFTER)
    from exoid_cli.app import main as run

    run()


if __name__ == "__main__":
    main()
