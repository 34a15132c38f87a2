"""What the operator's view costs the cycle that it shows."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import thread_time

from rich.console import Console as RichConsole

from exoid_cli.console import Console
from exoid_cli.operator_view import OperatorView
from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.progress import Progress
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.campaigns.bench.report import Row, show

RIG = datasets() / "rigs" / "plain.toml"
DURATION_S = 8.0
PAIRS = 3


def rows() -> Iterator[Row]:
    """Measure runs with and without the view in turn."""
    without, with_view, drawing = [], [], 0.0
    for _ in range(PAIRS):
        without.append(cycles_a_second(lambda progress: None))
        view = OperatorView(load_rig(RIG), "bench")
        with on_a_terminal(view) as screen:
            with_view.append(cycles_a_second(view.update))
            drawing = milliseconds(screen, view)
    share = 100 * median(a / b for a, b in zip(with_view, without, strict=True))
    yield Row(
        f"lockstep, two drives and four sensors, watched: of the cycles unwatched, in turn {PAIRS}"
        " times",
        f"{share:.0f} %: {median(with_view):.0f} of {median(without):.0f} cycles/s",
    )
    yield Row("one picture, 80 x 24, ten a second", f"{drawing:.1f} ms of processor time")


@contextmanager
def on_a_terminal(view: OperatorView) -> Iterator[RichConsole]:
    """Show a view on a terminal of 80 x 24 that nobody looks at."""
    console = Console()
    with open(os.devnull, "w") as nobody:
        console.err = RichConsole(
            file=nobody, force_terminal=True, color_system="256", width=80, height=24
        )
        with console.live(view):
            yield console.err


def milliseconds(screen: RichConsole, view: OperatorView) -> float:
    """Return the processor time of one picture, the median of many."""
    times = []
    for _ in range(50):
        began = thread_time()
        screen.print(view)
        times.append(1e3 * (thread_time() - began))
    return median(times)


def cycles_a_second(report: Callable[[Progress], None]) -> float:
    """Return how many cycles a second a run in lockstep reaches, start of the rig not counted."""
    rates = []

    def note(progress: Progress) -> None:
        report(progress)
        rates.append(progress.rate_hz)

    settings = RunSettings(name="bench", run="with_human", purpose="train", duration_s=DURATION_S)
    with TemporaryDirectory() as folder:
        acquire(
            RIG,
            settings,
            datasets() / "paper" / "trajectory.toml",
            Path(folder) / "bench.parquet",
            report=note,
        )
    return rates[-1]


if __name__ == "__main__":
    show("the operator's view", rows())
