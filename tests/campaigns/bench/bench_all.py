"""How long ``make all`` takes once exoid is installed: every stage anew, every kernel compiled
anew."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from pipelines.settings import datasets
from tests.campaigns.bench.report import Row, show


def rows() -> Iterator[Row]:
    """Run the default experiment twice, the second time with nothing to do."""
    with TemporaryDirectory() as folder:
        # An empty cache: a fresh clone has compiled nothing yet.
        environment = {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/cache", "MAKEFLAGS": ""}
        yield Row(
            "make all, first compilation included",
            f"{seconds(folder, environment):.0f} s",
            wanted="180 s",
        )
        yield Row("make all again, nothing to do", f"{seconds(folder, environment):.1f} s")


def seconds(folder: str, environment: dict[str, str]) -> float:
    """Return the wall time of one ``make all`` into a folder."""
    experiments = datasets() / "experiments"
    exoid = Path(sys.executable).with_name("exoid")
    command = ["make", "-j2", "-f", experiments / "experiment.mk", f"EXOID={exoid}"]
    began = time.monotonic()
    subprocess.run(
        [*command, f"CONFIG={experiments / 'default.toml'}", f"OUT={folder}/out", "all"],
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return time.monotonic() - began


if __name__ == "__main__":
    show("make all", rows())
