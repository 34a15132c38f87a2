"""The entry of exoid: a signal that comes while Python still loads it ends it in one line, too."""

import gc
import os
import signal

EARLY = {"SIGINT": "Ctrl-C", "SIGTERM": "SIGTERM"}
"""Signals handled during loading, with the user's names; others have the system's default."""


def _end(number: int, frame: object) -> None:
    # Not an exception, which an import would take for its own failure; nothing needs clean-up yet.
    os.write(2, f"exoid: stopped by {EARLY[signal.Signals(number).name]}\n".encode())
    os._exit(128 + number)


def main() -> None:
    """Run exoid as the shell's command."""
    # New objects after which Python searches for unused ones.
    collect_after = 50_000
    # Environment variables of numpy's libraries. exoid's matrices are too small for several
    # threads, which would only take the processor from other commands.
    threads = (
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "OMP_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    )
    for name in EARLY:
        number = signal.Signals[name]
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)
    for name in threads:
        os.environ.setdefault(name, "1")
    # Loading creates many objects that stay; searching them repeatedly takes a fifth of the time.
    gc.set_threshold(collect_after)
    from exoid_cli.app import main as run

    run()


if __name__ == "__main__":
    main()
