"""``exoid acquire`` in a process of its own, on a rig in this one that remembers what it latched
and when."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipelines.acquisition.recording.journal_file import JournalFile
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import ContractError
from tests.campaigns.faults.faults import nothing
from tests.campaigns.faults.proxy import Proxy
from tests.campaigns.faults.runs import (
    EXCITATION,
    RATE,
    SEED,
    Latched,
    are_disabled,
    rig_file,
    served,
)

PATIENCE_S = 120.0


@dataclass(frozen=True)
class Ended:
    """A process that has ended, and what the rig knows of it."""

    code: int
    error: str
    output: Path
    latched: dict[int, Latched]
    struck_at: float
    """When it was struck, s."""
    disabled: bool


def strike(
    folder: Path, blow: Callable[[subprocess.Popen, Path], None], rows: int, wait_s: float = 0.0
) -> Ended:
    """Start an endless run, and once it has written so many rows, and a while longer, strike it."""
    folder.mkdir(parents=True, exist_ok=True)
    output = folder / "run.parquet"
    (folder / "excitation.toml").write_text(EXCITATION)
    with served(folder, "exo_alone") as (port, latched), Proxy(port, nothing) as proxy:
        rig = rig_file(folder, proxy.port, watchdog_s=10.0, reply_s=1.0)
        config = folder / "exoid.toml"
        config.write_text(
            f'[acquire]\nrig = "{rig.name}"\nsample_rate_hz = {RATE}\n[[run]]\nname = "run"\nrun ='
            f' "exo_alone"\npurpose = "train"\nduration_s = 4000.0\nseed = {SEED}\n'
        )
        command = [
            sys.executable,
            "-m",
            "exoid_cli.app",
            "acquire",
            "--config",
            str(config),
            "--run",
            "run",
            "--trajectory",
            str(folder / "excitation.toml"),
            "-o",
            str(output),
        ]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            _wait_for(process, output, rows)
            time.sleep(wait_s)
            blow(process, output)
            struck_at = time.monotonic()
            _, error = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
            process.communicate()
    return Ended(process.returncode, error.strip(), output, latched, struck_at, are_disabled(proxy))


def send(number: signal.Signals) -> Callable[[subprocess.Popen, Path], None]:
    """Return a blow that is a signal."""
    return lambda process, output: os.kill(process.pid, number)


def fill_the_disk(process: subprocess.Popen, output: Path) -> None:
    """Let no file of the process grow by more than a few samples: in the midst of a batch it can
    write no more."""
    room = journal_of(output).stat().st_size + 3000
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (room, room))


def _wait_for(process: subprocess.Popen, output: Path, rows: int) -> None:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until and process.poll() is None:
        try:
            if (
                sum(batch.rows.num_rows for batch in JournalFile(journal_of(output)).batches())
                >= rows
            ):
                return
        except (FileNotFoundError, ContractError):
            pass
        time.sleep(0.02)
    raise AssertionError(f"the run has not come to {rows} rows")
