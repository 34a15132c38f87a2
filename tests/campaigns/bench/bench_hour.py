"""Memory of an hour at 1 kHz over Modbus TCP: in lockstep, so that it takes as long as it takes."""

import re
import resource
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from pipelines.acquisition.acquire import acquire
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from tests.campaigns.bench.report import Row, show

HOUR_S = 3600.0
EARLY = 0.05
"""Share of the run after which everything is loaded, compiled and filled once."""


def rows(duration_s: float = HOUR_S) -> Iterator[Row]:
    """Measure; a quarter of an hour on an idle machine."""
    used: list[tuple[int, float]] = []
    began = time.perf_counter()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rig.toml"
        text = (datasets() / "rigs" / "recorder.toml").read_text()
        for key, value in (("clock", '"lockstep"'), ("watchdog_s", "5.0"), ("heartbeat_s", "5.0")):
            text = re.sub(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
        path.write_text(text)
        settings = RunSettings(name="hour", run="exo_alone", purpose="train", duration_s=duration_s)
        excitation, output = datasets() / "paper" / "trajectory.toml", Path(folder) / "hour.parquet"
        outcome = acquire(
            path,
            settings,
            excitation,
            output,
            report=lambda p: used.append((p.samples, peak_mib())),
        )
        took_s, size = time.perf_counter() - began, output.stat().st_size
    early = next(mib for samples, mib in used if samples >= EARLY * outcome.samples)
    yield Row(
        f"{duration_s / 60:g} min at 1 kHz in lockstep ({outcome.samples} samples, {took_s:.0f} s)",
        f"{outcome.missed} missed; file of {size / 1e6:.0f} MB",
        wanted="0 missed",
    )
    yield Row(
        "most memory of exoid",
        f"{early:.0f} MiB after {EARLY:.0%} of it, {used[-1][1]:.0f} at its end, {peak_mib():.0f}"
        " with the file made",
        wanted="does not grow",
    )


def peak_mib() -> float:
    """Return the most memory that this process has had resident so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    show("an hour", rows())
