"""The commands of exoid, and the one place where an error becomes a line and an exit code.

0 is success, 1 a fault of exoid itself, 2 the user's to mend, 3 a device's, 130 a stop by Ctrl-C,
129, 131 and 143 one by SIGHUP, SIGQUIT and SIGTERM.
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
from exoid_cli.detect import detect
from exoid_cli.diagnose import diagnose
from exoid_cli.effects import effects
from exoid_cli.export import export
from exoid_cli.figures import figures
from exoid_cli.filter import filter_
from exoid_cli.heeding import Command, JsonOption, QuietOption, heeding
from exoid_cli.identify import identify
from exoid_cli.import_ import import_
from exoid_cli.init import init
from exoid_cli.lasting import outlast_terminals
from exoid_cli.recover import recover
from exoid_cli.report import report
from exoid_cli.rig_group import rig
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
    app.command(name, cls=Command, short_help=short_help)(heeding(function))


# In the order of an experiment. The short help fits on the one line that the list of commands has
# for it.
_add("init", init, "Start a new experiment.")
_add("status", status, "Say which stages are done, stale or missing.")
_add("run", run_, "Do what is missing or stale, as make does.")
_add("design", design, "Search an excitation, or judge a given one.")
_add("acquire", acquire, "Move the leg along an excitation; record every sample.")
_add("recover", recover, "Make a recording of what a killed run left.")
_add("import", import_, "Make recordings of logs from elsewhere.")
_add("filter", filter_, "Filter a recording's angles and differentiate them.")
_add("identify", identify, "Fit the leg's parameters; judge them on other runs.")
_add("diagnose", diagnose, "Name what the model gets wrong, and measure the gain.")
_add("simulate", simulate, "Simulate the identified leg, or replay a recording.")
_add("report", report, "Write one page that shows all that was found.")
_add("figures", figures, "Draw the report's figures as PDF and PNG.")
_add("export", export, "Hand a model to MuJoCo, URDF, MATLAB, C or JSON.")
_add("show", show, "Say what a file is, and what is in it.")
_add("effects", effects, "List the effects a model can have, or explain one.")
_add("detect", detect, "Say which causes a motion would reveal.")
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
    """Set what every command heeds; --quiet and --json may also follow the command."""
    console.heed(quiet=quiet, json=json)


INTERRUPTED = 130
"""What typer makes of KeyboardInterrupt."""
UNHEARD = 128 + 13
"""Exit code of a stop by SIGPIPE, as shells have it; Windows does not know it."""


def main() -> NoReturn:
    """Run exoid as the shell's command."""
    if not (sys.warnoptions or os.environ.get("EXOID_DEBUG")):
        # Of Python's libraries, about exoid's own lines: the tests heed them.
        warnings.simplefilter("ignore")
        # A signal that falls into one of several requests at once is told as what ended exoid, and
        # by asyncio as well.
        logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    signals.heed()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")  # Windows' pipes have one that knows no N·m
    outlast_terminals()
    arguments = sys.argv[1:]
    sys.exit(run(matching_files(arguments) if os.name == "nt" else arguments))


def matching_files(arguments: Sequence[str]) -> list[str]:
    """Return the words, patterns replaced by the files that match: Windows' shells leave that to
    us."""
    found = ((word, sorted(glob.glob(word)) if set("*?") & set(word) else []) for word in arguments)
    return [name for word, files in found for name in files or [word]]


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    console.configure()
    try:
        code = _command_line(arguments)
        sys.stdout.flush()  # not at the interpreter's end, where it would fail with a traceback
        signals.ignore()
        return code
    except BrokenPipeError:
        return _unheard()
    except ExoidError as error:
        return _failed(str(error), error.exit_code)
    except TyperException as error:
        return _failed(usage.told(error), error.exit_code)
    except KeyboardInterrupt:
        return _failed(signals.told(), signals.exit_code)
    except SystemExit as stop:
        # Which click and rich make a failure of ours.
        if isinstance(stop.__context__, BrokenPipeError):
            return _unheard()
        raise
    except OSError as error:
        return _failed(_about_the_system(error), 2)
    except Exception as error:
        if signals.came:  # whatever made that of it
            return _failed(signals.told(), signals.exit_code)
        return _failed(
            f"exoid itself failed: {type(error).__name__}: {error}; please report it,"
            f" {_keep_traceback()}",
            1,
        )


def _failed(text: str, code: int) -> int:
    """Tell how exoid ends; called while the error is being handled, which keeps signals from coming
    between."""
    console.fail(text)
    signals.ignore()
    return code


def _unheard() -> int:
    """Let nothing more be written to an output that nobody reads any longer, as of ``exoid effects
    | head -1``."""
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
    return UNHEARD


def _command_line(arguments: Sequence[str]) -> int:
    command = typer.main.get_command(app)
    # Not standalone: typer would print a box of several lines for a mistyped option.
    code = command.main(
        args=list(arguments) or ["--help"], prog_name="exoid", standalone_mode=False
    )
    if code == INTERRUPTED:
        raise KeyboardInterrupt  # of which typer makes an exit code, and says nothing
    return code or 0


_REMEDIES = {
    errno.EACCES: "you may not read or write there; change the permissions or choose another place",
    errno.EPERM: "you may not read or write there; change the permissions or choose another place",
    errno.ENOSPC: "free some space and run the command again",
    errno.EDQUOT: "free some space and run the command again",
    errno.EFBIG: (
        "files may not be so large there; raise the limit (ulimit -f), or choose another place"
    ),
    errno.EROFS: "choose a folder that can be written to",
    errno.ENOENT: "check the name",
    errno.EEXIST: "a file stands where a folder should; choose another name",
    errno.ENOTDIR: "a file stands where a folder should; choose another name",
}


def _about_the_system(error: OSError) -> str:
    place = f"{error.filename}: " if error.filename else ""
    remedy = _REMEDIES.get(error.errno or 0)
    # Arrow's own words are no user's.
    what = os.strerror(error.errno or 0) if remedy else error.strerror or error
    return f"{place}{what}" + (f"; {remedy}" if remedy else "")


def _keep_traceback() -> str:
    """Show the traceback where EXOID_DEBUG asks for it, else keep it in a file; say where it is."""
    if os.environ.get("EXOID_DEBUG"):
        traceback.print_exc()
        return "with the traceback above"
    path = Path(tempfile.gettempdir()) / f"exoid-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.log"
    path.write_text(traceback.format_exc(), encoding="utf-8")
    return f"with {path}"


if __name__ == "__main__":
    main()
