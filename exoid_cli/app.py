"""The commands of exoid; here, and only here, an error becomes a line and an exit code.

0 is success, 1 a fault of exoid, 2 an input that the user must correct, 3 a device's fault, 130 a
stop by Ctrl-C, 129, 131 and 143 a stop by SIGHUP, SIGQUIT and SIGTERM, 141 a closed pipe.

A command's function imports the libraries that it needs, so that help and light commands start
fast; tests/cli/test_imports.py lists the libraries that each of them may not import.
"""

import errno
import glob
import io
import logging
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from typer.exceptions import TyperException

from exoid_cli import usage
from exoid_cli.acquire import acquire
from exoid_cli.console import console
from exoid_cli.design import design
from exoid_cli.detached_terminal import tolerate_closed_terminals
from exoid_cli.detect import detect
from exoid_cli.diagnose import diagnose
from exoid_cli.effects import effects
from exoid_cli.export import export
from exoid_cli.figures import figures
from exoid_cli.filter import filter_
from exoid_cli.global_options import Command, JsonOption, QuietOption, with_global_options
from exoid_cli.identify import identify
from exoid_cli.import_ import import_
from exoid_cli.init import init
from exoid_cli.investigate import investigate
from exoid_cli.next_ import next_
from exoid_cli.recover import recover
from exoid_cli.report import report
from exoid_cli.rig import rig
from exoid_cli.run import run as run_
from exoid_cli.settings import settings
from exoid_cli.show import show
from exoid_cli.signals import signals
from exoid_cli.simulate import simulate
from exoid_cli.status import status
from pipelines import __version__
from pipelines.errors import ExoidError

app = typer.Typer(
    name="exoid",
    help=(
        "Identification experiments on an exoskeleton leg: what the model gets wrong, and why.\n\n"
        "\b\nExample:\n  exoid init my_experiment\n  cd my_experiment\n  exoid run\n  exoid status"
    ),
    # Plain text: brackets of [design] are no markup, and examples can be copied.
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _add(name: str, function: Callable[..., None], short_help: str) -> None:
    app.command(name, cls=Command, short_help=short_help)(with_global_options(function))


# In the order of an experiment. The short help fits on the one line that the list of commands has
# for it.
_add("init", init, "Start a new experiment.")
_add("status", status, "Say which stages are done, stale or missing.")
_add("run", run_, "Do what is missing or stale, as make does.")
_add("design", design, "Search an excitation, or judge a given one.")
_add("acquire", acquire, "Move the leg along an excitation; record every sample.")
_add("recover", recover, "Make a recording of a killed run's journal.")
_add("import", import_, "Make recordings of logs from elsewhere.")
_add("filter", filter_, "Filter a recording's angles and differentiate them.")
_add("identify", identify, "Fit the leg's parameters; judge them on other runs.")
_add("diagnose", diagnose, "Name what the model gets wrong, and measure the gain.")
_add("next", next_, "Say which experiment would decide between causes.")
_add("investigate", investigate, "Record further experiments until a verdict is sure.")
_add("simulate", simulate, "Simulate the identified leg, or replay a recording.")
_add("report", report, "Write one page that shows all results.")
_add("figures", figures, "Draw the report's figures as PDF and PNG.")
_add("export", export, "Export a model to MuJoCo, URDF, MATLAB, C or JSON.")
_add("show", show, "Describe a file: contract, origin and content.")
_add("effects", effects, "List the effects a model can have, or explain one.")
_add("detect", detect, "List the causes that a motion reveals.")
app.add_typer(rig, name="rig", short_help="Check a rig, or serve a virtual one.")
app.add_typer(settings, name="settings", short_help="Work with an experiment's settings.")


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"exoid {__version__}")
        raise typer.Exit


@app.callback()
def options(
    quiet: QuietOption = False,
    json: JsonOption = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Set the global options; --quiet and --json may also follow the command."""
    console.add_options(quiet=quiet, json=json)


def main() -> NoReturn:
    """Run exoid as the shell's command."""
    if not (sys.warnoptions or os.environ.get("EXOID_DEBUG")):
        # Python's warnings concern developers; the tests turn them into errors.
        warnings.simplefilter("ignore")
        # asyncio logs a signal during several requests, which exoid reports itself.
        logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    signals.handle()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")  # pipes on Windows cannot encode N·m otherwise
    tolerate_closed_terminals()
    arguments = sys.argv[1:]
    sys.exit(run(expand_patterns(arguments) if os.name == "nt" else arguments))


def expand_patterns(arguments: Sequence[str]) -> list[str]:
    """Replace each pattern by the files that match it, as shells do except on Windows."""
    words = list[str]()
    for word in arguments:
        files = sorted(glob.glob(word)) if set("*?") & set(word) else []
        words += files or [word]
    return words


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    console.reset()
    try:
        code = _command_line(arguments)
        sys.stdout.flush()  # at the interpreter's end it would fail with a traceback
        signals.ignore()
        return code
    except BrokenPipeError:
        return _broken_pipe()
    except ExoidError as error:
        return _fail(str(error), error.exit_code)
    except TyperException as error:
        return _fail(usage.message(error), error.exit_code)
    except KeyboardInterrupt:
        return _fail(signals.message(), signals.exit_code)
    except SystemExit as stop:
        # click and rich turn a broken pipe into an exit of their own.
        if isinstance(stop.__context__, BrokenPipeError):
            return _broken_pipe()
        raise
    except OSError as error:
        return _fail(_system_error(error), 2)
    except Exception as error:
        if signals.last:  # a library turned the interruption into an error of its own
            return _fail(signals.message(), signals.exit_code)
        return _fail(
            f"exoid itself failed: {type(error).__name__}: {error}; please report it,"
            f" {_keep_traceback()}",
            1,
        )


def _fail(text: str, code: int) -> int:
    """Print the error and return the exit code.

    Called inside the ``except`` block, which keeps signals from interrupting it.
    """
    console.fail(text)
    signals.ignore()
    return code


def _broken_pipe() -> int:
    """Discard further output, which nobody reads after ``exoid effects | head -1``."""
    with open(os.devnull, "w") as devnull:
        os.dup2(devnull.fileno(), sys.stdout.fileno())
    return 128 + 13  # as shells report a stop by SIGPIPE; Windows has no such signal


def _command_line(arguments: Sequence[str]) -> int:
    command = typer.main.get_command(app)
    # Not standalone: typer would print a box of several lines for a mistyped option.
    code = command.main(
        args=list(arguments) or ["--help"], prog_name="exoid", standalone_mode=False
    )
    if code == 130:
        raise KeyboardInterrupt  # of which typer makes this exit code, without a message
    return code or 0


def _system_error(error: OSError) -> str:
    file = f"{error.filename}: " if error.filename else ""
    denied = "you may not read or write there; change the permissions or choose another place"
    full = "free some space and run the command again"
    remedies = {
        errno.EACCES: denied,
        errno.EPERM: denied,
        errno.ENOSPC: full,
        errno.EDQUOT: full,
        errno.EFBIG: (
            "files may not be so large there; raise the limit (ulimit -f), or choose another place"
        ),
        errno.EROFS: "choose a folder that can be written to",
        errno.ENOENT: "check the name",
        errno.EEXIST: "a file stands where a folder should; choose another name",
        errno.ENOTDIR: "a file stands where a folder should; choose another name",
    }
    remedy = remedies.get(error.errno or 0)
    if remedy is None:
        return f"{file}{error.strerror or error}"
    # The system's words: Arrow's own would mean nothing to a user.
    return f"{file}{os.strerror(error.errno or 0)}; {remedy}"


def _keep_traceback() -> str:
    """Print the traceback under EXOID_DEBUG, else write it to a file; say where it is."""
    if os.environ.get("EXOID_DEBUG"):
        traceback.print_exc()
        return "with the traceback above"
    path = Path(tempfile.gettempdir()) / f"exoid-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.log"
    path.write_text(traceback.format_exc(), encoding="utf-8")
    return f"with {path}"


if __name__ == "__main__":
    main()
