"""Four commands at once against one alone, four times: how well they share a machine."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from pipelines.settings import datasets
from tests.campaigns.bench.report import Row, show

COMMANDS = 4
"""At once, each in its own experiment."""
RESULTS = {
    "design": "trajectory.parquet",
    "acquire": "recordings",
    "filter": "motions",
    "identify": "identified",
    "diagnose": "diagnosed",
    "simulate": "simulated",
    "report": "report.html",
}
"""What each stage of the default experiment writes."""


def rows() -> Iterator[Row]:
    """Run the default experiment once, then each of its stages anew in four copies of it."""
    with TemporaryDirectory() as name:
        folders = [Path(name) / str(k) for k in range(COMMANDS)]
        _seconds("all", folders[:1])  # compiles, too
        for copy in folders[1:]:
            shutil.copytree(folders[0], copy)
        for stage in RESULTS:
            one_after_another = COMMANDS * _anew(stage, folders[:1])
            at_once = _anew(stage, folders)
            yield Row(
                f"exoid {stage}, {COMMANDS} at once against one after another",
                f"{at_once:.1f} s against {one_after_another:.1f} s",
                one_after_another / at_once,
                "1 or more",
            )


def _anew(stage: str, folders: Sequence[Path]) -> float:
    """Return how long a stage takes in all folders at once, its results deleted before."""
    for folder in folders:
        result = folder / RESULTS[stage]
        shutil.rmtree(result) if result.is_dir() else result.unlink()
    return _seconds(stage, folders)


def _seconds(stage: str, folders: Sequence[Path]) -> float:
    """Return the wall time of a stage that begins in all folders at once."""
    exoid = Path(sys.executable).with_name("exoid")
    config = datasets() / "experiments" / "default.toml"
    # What a user has: nothing is set for the sake of the measurement.
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    stages = [] if stage == "all" else [stage]
    began = time.monotonic()
    running = [
        subprocess.Popen(
            [exoid, "run", *stages, "--config", config, "--out", folder, "--yes", "--quiet"],
            env=environment,
            stdout=subprocess.DEVNULL,
        )
        for folder in folders
    ]
    if any(process.wait() for process in running):
        raise RuntimeError(f"exoid run {stage} failed")
    return time.monotonic() - began


if __name__ == "__main__":
    show("four commands at once", rows())
