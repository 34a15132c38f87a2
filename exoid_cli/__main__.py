"""The entry of exoid: a signal that comes while Python still loads it ends it in one line, too."""

import gc
import os
import signal


def main() -> None:
    """Run exoid as the shell's command."""
    # Signals handled during loading, with the user's names; others have the system's default.
    early = {"SIGINT": "Ctrl-C", "SIGTERM": "SIGTERM"}

    def end(number: int, frame: object) -> None:
        # Not an exception, which an import would take for its own failure; nothing needs clean-up
        # yet.
        os.write(2, f"exoid: stopped by {early[signal.Signals(number).name]}\n".encode())
        os._exit(128 + number)

    for name in early:
        number = signal.Signals[name]
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, end)
    # For numpy's libraries: exoid's matrices are too small for several threads, which would only
    # take the processor from other commands.
    for name in ("OPENBLAS_NUM", "MKL_NUM", "OMP_NUM", "VECLIB_MAXIMUM"):
        os.environ.setdefault(f"{name}_THREADS", "1")
    # Loading creates many objects that stay; searching them repeatedly takes a fifth of the time.
    gc.set_threshold(50_000)
    from exoid_cli.app import main as run

    run()


if __name__ == "__main__":
    main()
