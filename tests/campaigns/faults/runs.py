"""A short run on a virtual rig behind the proxy, compared with the samples that the rig latched."""

import asyncio
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipelines.acquisition.acquire import acquire
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError
from pipelines.mechanics.motion import CUFFS
from pipelines.rig import server
from pipelines.rig.plant import Samples
from pipelines.rig.virtual_rig import build_plant
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.campaigns.faults.faults import REPLY_S, WATCHDOG_S
from tests.campaigns.faults.proxy import Fault, Frame, Proxy, RtuFrame, TcpFrame

CONTROL, DISABLE = 2, 0
"""Which of a drive's written words is the control word, and which one takes the torque
away."""
RATE = 100.0
SEED = 5
EXCITATION = """\
unit = "rad"
omega_rad_s = 6.283185307179586
theta0_rad = [0.15, -0.25]
a = [[0.08, 0.0], [0.08, 0.0]]
b = [[0.0, 0.02], [0.02, -0.02]]
"""
RESOLUTION = {
    ("angle", "rad"): 1e-6,
    ("velocity", "rad_s"): 1e-5,
    ("torque", "nm"): 0.12 * 100 * 1e-4,
}
"""What one count of each register stands for, rad, rad/s, N·m."""


@dataclass(frozen=True)
class Latched:
    """A sample that the rig has latched, and when, s."""

    sample: Samples
    at: float


@dataclass(frozen=True)
class Result:
    """What became of a run."""

    why: str | None
    """Why it stopped; None where it did not."""
    frame: pd.DataFrame
    metadata: dict
    wrong: int
    """Recorded samples that the rig never latched like that."""
    wrong_s: float
    """How long before its end the recording's first wrong sample is."""
    disabled: bool
    """Whether the last word written to each drive takes its torque away."""

    @property
    def missing(self) -> int:
        return sum(count for _, count in self.metadata.get("gaps", []))


def rig_file(folder: Path, port: int, frames: type[Frame] = TcpFrame, **changes: float) -> Path:
    """Write the plain rig, all on one port or on one RTU line through it, with short ramps."""
    text = (
        (datasets() / "rigs" / "plain.toml")
        .read_text()
        .replace("embedded = true", "embedded = false", 1)
    )
    place = f"port = {port}" if frames is TcpFrame else 'line = "leg"'
    text = re.sub(r"^(map = .*)$", rf"\1\n{place}", text, flags=re.MULTILINE)
    if frames is RtuFrame:
        text += f'\n[line.leg]\ntransport = "rtu_over_tcp"\nport = {port}\n'
    text = text.replace("[safety]\n", "[safety]\nreply_s = 0\n")
    short = {"ramp_s": 0.4, "settle_s": 0.1, "watchdog_s": WATCHDOG_S, "reply_s": REPLY_S}
    for key, value in {**short, **changes}.items():
        text, count = re.subn(rf"^{key} = [^#\n]*", f"{key} = {value} ", text, flags=re.MULTILINE)
        assert count, key
    path = folder / f"rig{port}.toml"
    path.write_text(text)
    return path


@contextmanager
def served(
    folder: Path, run: str, frames: type[Frame] = TcpFrame
) -> Iterator[tuple[int, dict[int, Latched]]]:
    """Serve the rig; yields its port, and all that it latches by number."""
    path = rig_file(folder, 502, frames)
    rig = load_rig(path)
    plant, latched = build_plant(rig, path, run, SEED, RATE), dict[int, Latched]()
    advance = plant.run

    def remembered(*arguments: object) -> Samples:
        samples = advance(*arguments)
        for k, number in enumerate(samples.sequence.tolist()):
            latched[number] = Latched(samples[k : k + 1], time.monotonic())
        return samples

    plant.run = remembered
    listening, ports, ends = threading.Event(), list[int](), []

    def announce(place: str, line: str | None) -> None:
        ports.append(int(place.rpartition(":")[2]))
        listening.set()

    async def serve() -> None:
        until = asyncio.Event()
        ends.append((asyncio.get_running_loop(), until))
        await server.serve(rig, plant, 0, announce, until, sample_rate_hz=RATE)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert listening.wait(180)  # the first start compiles the plant
        yield ports[0], latched
    finally:
        loop, until = ends[0]
        loop.call_soon_threadsafe(until.set)
        thread.join()


def run_through(
    fault: Fault,
    folder: Path,
    run: str = "exo_alone",
    duration_s: float = 1.0,
    motion: str = EXCITATION,
    frames: type[Frame] = TcpFrame,
    **changes: float,
) -> Result:
    """Record a run with a fault between client and rig; ``changes`` are of the rig file."""
    excitation, output = folder / "excitation.toml", folder / "run.parquet"
    excitation.write_text(motion)
    settings = RunSettings(name="run", run=run, purpose="train", duration_s=duration_s, seed=SEED)
    with served(folder, run, frames) as (port, latched), Proxy(port, fault, frames) as proxy:
        why = None
        try:
            acquire(
                rig_file(folder, proxy.port, frames, **changes), settings, excitation, output, RATE
            )
        except DeviceError as error:
            why = str(error)
    disabled = are_disabled(proxy)
    kept = output if why is None else folder / "run.aborted.parquet"
    assert kept.exists(), why
    table = RECORDING.read(kept)
    wrong = wrong_rows(table.frame, latched)
    wrong_s = (len(wrong) - int(np.argmax(wrong))) / RATE if wrong.any() else 0.0
    return Result(why, table.frame, table.metadata, int(wrong.sum()), wrong_s, disabled)


def are_disabled(proxy: Proxy) -> bool:
    """Return whether the last word written to each drive takes its torque away."""
    return {words[CONTROL] for words in proxy.written.values()} == {DISABLE}


def wrong_rows(frame: pd.DataFrame, latched: dict[int, Latched]) -> np.ndarray:
    """Return (rows,) whether a row holds a value that was not latched with its number."""
    truth = [latched[number].sample for number in frame["sequence"]]
    began = truth[0].time[0] - frame["time_s"].iloc[0]
    wrong = np.abs(frame["time_s"].to_numpy() + began - [sample.time[0] for sample in truth]) > 3e-6
    for (quantity, unit), resolution in RESOLUTION.items():
        true = np.array([getattr(sample, quantity)[0] for sample in truth])
        recorded = frame[[f"{joint}_{quantity}_{unit}" for joint in ("hip", "knee")]].to_numpy()
        wrong |= (np.abs(recorded - true) > 0.6 * resolution).any(axis=1)
    for k, cuff in enumerate(CUFFS):
        columns = [f"{cuff}_force_{axis}_n" for axis in "xyz"]
        if columns[0] in frame:
            true = np.array([sample.forces[0, k] for sample in truth])
            wrong |= (np.abs(frame[columns].to_numpy() - true) > 1e-3).any(axis=1)
    return wrong
