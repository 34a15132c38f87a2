"""Give recordings to ``exoid diagnose`` and nothing else, and keep what it answers."""

import hashlib
import json
import os
import random
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.detection import smallest_visible
from tests.campaigns.blind.scoring import Score, score

SIMULATOR = (
    "body",
    "cases",
    "causes",
    "channel",
    "compiled",
    "conditions",
    "cuffs",
    "dry",
    "encoders",
    "excitation",
    "families",
    "faults",
    "floor",
    "further_forms",
    "further_torques",
    "imperfections",
    "legs",
    "loop",
    "machine",
    "magnitude",
    "mechanisms",
    "outside",
    "people",
    "plan",
    "planar",
    "plant",
    "recorded",
    "recorder",
    "session",
    "smooth",
    "temperature",
    "trajectories",
    "transmissions",
    "two_link",
    "two_mass",
    "units",
    "wandering",
    "worlds",
)
"""What decides how a session looks: when one of these files changes, sessions are simulated
again."""
ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}
TIME_LIMIT_S = 600.0
EXOID = (Path(sys.executable).with_name("exoid"),)


@dataclass(frozen=True)
class Folders:
    """Where an examination keeps its things. What is diagnosed and what is true lie apart."""

    root: Path

    def recordings(self, name: str) -> Path:
        """Folder of one session's recordings."""
        return self.root / "sessions" / name

    def truth(self, name: str) -> Path:
        """What was hidden in it."""
        return self.root / "truth" / f"{name}.json"

    def answer(self, name: str) -> Path:
        """Folder of what the diagnosis wrote."""
        return self.root / "answers" / name


def fingerprint() -> str:
    """Return a hash of the simulator's sources."""
    digest = hashlib.sha256()
    for name in SIMULATOR:
        digest.update((Path(__file__).parent / f"{name}.py").read_bytes())
    return digest.hexdigest()


def neutral_name(case: Case) -> str:
    """Name a session so that the name says nothing, and is another one when the simulator has
    changed."""
    return hashlib.sha256(f"{fingerprint()} {case}".encode()).hexdigest()[:12]


def drawn(planned: Sequence[Case], most: int) -> list[Case]:
    """Return at most so many of the cases, in a random order that is the same for any number."""
    order = list(planned)
    random.Random(1).shuffle(order)
    return order[:most]


def examine(
    cases: Sequence[Case], root: Path, workers: int = 2, again: bool = False
) -> Iterator[Score]:
    """Simulate what is not there yet, diagnose, and yield scores as they come.

    Parameters
    ----------
    cases : sequence of Case
    root : Path
        Sessions and answers found there are used again.
    workers : int
        Sessions at a time.
    again : bool
        Diagnose anew what has an answer already: the sessions stay, the program has changed.
    """
    # Spawned, not forked: who calls may have threads, as pytest's workers do.
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        pending = [pool.submit(examine_one, case, Folders(root.resolve()), again) for case in cases]
        for done in as_completed(pending):
            yield done.result()


def examine_one(case: Case, folders: Folders, again: bool) -> Score:
    """Return the score of one case."""
    name = neutral_name(case)
    prepare(case, folders)
    kept = folders.answer(name) / "answer.json"
    if again or not kept.exists():
        shutil.rmtree(folders.answer(name), ignore_errors=True)
        folders.answer(name).mkdir(parents=True)
        kept.write_text(
            json.dumps(diagnose(folders.recordings(name), folders.answer(name)), indent=1)
        )
    answer = json.loads(kept.read_text())
    truth = json.loads(folders.truth(name).read_text())
    return score(truth, answer, smallest_visible(folders.answer(name)))


def prepare(case: Case, folders: Folders) -> None:
    """Simulate a case unless its session is there."""
    name = neutral_name(case)
    if not folders.truth(name).exists():
        # Here and not above: who only scores need not load the simulator and its compiled loops.
        from tests.campaigns.blind.session import simulate, write

        write(simulate(case), folders.recordings(name), folders.truth(name))


def diagnose(recordings: Path, out: Path, program: Sequence[str | Path] = EXOID) -> dict[str, Any]:
    """Run ``exoid diagnose`` on a folder's recordings and return what came of it."""
    files = sorted(path.name for path in recordings.glob("*.parquet"))
    begin = _processor_seconds()
    try:
        ended = subprocess.run(
            [*program, "diagnose", *files, "--out", out, "--no-figures"],
            cwd=recordings,
            env=os.environ | ONE_THREAD,
            text=True,
            capture_output=True,
            timeout=TIME_LIMIT_S,
        )
        exit_code, message = ended.returncode, ended.stderr[-2000:]
    except subprocess.TimeoutExpired:
        exit_code, message = 1, f"no answer within {TIME_LIMIT_S:g} s"
    verdict = out / "verdict.json"
    return {
        "exit_code": exit_code,
        # Wrapped to the terminal's width; words must stay whole to be found.
        "message": " ".join(message.split()),
        "seconds": _processor_seconds() - begin,
        "verdict": json.loads(verdict.read_text()) if exit_code == 0 and verdict.exists() else None,
    }


def _processor_seconds() -> float:
    """Return the processor time of the programs that this process has run: whatever else the
    machine does, it is the same."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
