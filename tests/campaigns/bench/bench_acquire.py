"""Speed of acquisition over Modbus TCP on this machine: rig and client in a process each."""

import re
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.machine.embedded_rig import embedded
from pipelines.acquisition.progress import Progress
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.campaigns.bench import bare_loop
from tests.campaigns.bench.report import Row, show

PAIRS = 9
RECORDER = ((100.0, 600.0), (200.0, 60.0))
"""Set-points a second, the rig file's own advice first, and for how long (s)."""


def rows() -> Iterator[Row]:
    """Measure; the runs' own length is the better part of what this takes."""
    for what, run, duration_s, wanted in (
        ("two drives", "exo_alone", 40.0, 900),
        ("two drives and four sensors", "with_human", 20.0, 400),
    ):
        rate = cycles_a_second(run, duration_s)
        yield Row(f"lockstep, {what}", f"{rate:.0f} cycles/s", wanted=f"{wanted} cycles/s")
    ours, bare = beside_a_bare_loop(5.0)
    share = 100 * median(a / b for a, b in zip(ours, bare, strict=True))
    yield Row(
        f"the latter beside a bare loop of the same calls, in turn on one rig, {PAIRS} times",
        f"{share:.0f} %: {median(ours):.0f} of {median(bare):.0f} cycles/s",
        wanted="70 %",
    )
    samples, missed = real_time(60.0)
    yield Row(f"real time, 200 Hz, 60 s ({samples} samples)", f"{missed} missed", wanted="0 missed")
    for set_points_hz, duration_s in RECORDER:
        samples, missed, load = recorder(set_points_hz, duration_s)
        what = (
            f"recorder, 1 kHz, two drives told {set_points_hz:g} times a second,"
            f" {duration_s / 60:g} min"
        )
        told = f"{missed} of {samples} missed, {100 * load:.0f} % of a core"
        yield Row(what, told, wanted="0 missed, 40 %")


def cycles_a_second(run: str, duration_s: float) -> float:
    """Return how many cycles a second a run in lockstep reaches, start of the rig not counted."""
    rates = []
    with TemporaryDirectory() as folder:
        _record(
            datasets() / "rigs" / "plain.toml",
            run,
            duration_s,
            Path(folder),
            lambda p: rates.append(p.rate_hz),
        )
    return rates[-1]


def beside_a_bare_loop(duration_s: float) -> tuple[list[float], list[float]]:
    """Return cycles a second of runs, and of loops of the same pymodbus calls, each pair on the
    same rig."""
    path, ours, bare = datasets() / "rigs" / "plain.toml", [], []
    text = path.read_text().replace("embedded = true", "embedded = false", 1)
    settings = RunSettings(name="bench", run="with_human", purpose="train", duration_s=duration_s)
    with TemporaryDirectory() as folder, embedded(load_rig(path), path, settings, 200.0) as rig:
        served = Path(folder) / "rig.toml"
        served.write_text(
            re.sub(r"^(map = .*)$", rf"\1\nport = {rig.drive[0].port}", text, flags=re.MULTILINE)
        )
        for k in range(PAIRS):
            bare.append(bare_loop.cycles_a_second(rig))
            rates: list[float] = []
            output = Path(folder) / f"{k}.parquet"
            excitation = datasets() / "paper" / "trajectory.toml"
            acquire(served, settings, excitation, output, report=lambda p: rates.append(p.rate_hz))  # noqa: B023
            ours.append(rates[-1])
    return ours, bare


def real_time(duration_s: float) -> tuple[int, int]:
    """Return samples and missed samples of a run in real time."""
    with TemporaryDirectory() as folder:
        path = _without_limits("real_time", Path(folder))
        outcome = _record(path, "exo_alone", duration_s, Path(folder), lambda progress: None)
    return outcome.samples, outcome.missed


def _without_limits(shipped: str, folder: Path) -> Path:
    """Write a rig file: a missed sample shall be counted here, not end the run for the jerk that it
    gives the leg."""
    text = (datasets() / "rigs" / f"{shipped}.toml").read_text()
    path = folder / f"{shipped}.toml"
    for key, most in (
        ("torque_nm", 300.0),
        ("cuff_force_n", 1e4),
        ("speed_rad_s", 30.0),
    ):  # what its registers can tell
        text = re.sub(rf"^{key} = .*$", f"{key} = {most}", text, flags=re.MULTILINE)
    path.write_text(text)
    return path


def recorder(set_points_hz: float, duration_s: float) -> tuple[int, int, float]:
    """Return samples and missed samples of a run that drains rings, and the share of a core that it
    takes."""
    used: list[tuple[float, float]] = []

    def note(progress: Progress) -> None:
        if progress.samples:
            used.append((time.perf_counter(), time.process_time()))

    with TemporaryDirectory() as folder:
        path = _without_limits("recorder", Path(folder))
        outcome = _record(path, "exo_alone", duration_s, Path(folder), note, set_points_hz)
    (began, before), (ended, after) = used[0], used[-1]
    return outcome.samples, outcome.missed, (after - before) / (ended - began)


def _record(
    rig: Path, run: str, duration_s: float, folder: Path, report, set_points_hz: float = 200.0
):
    settings = RunSettings(name="bench", run=run, purpose="train", duration_s=duration_s)
    excitation = datasets() / "paper" / "trajectory.toml"
    return acquire(
        rig, settings, excitation, folder / "bench.parquet", set_points_hz, report=report
    )


if __name__ == "__main__":
    show("exoid acquire", rows())
