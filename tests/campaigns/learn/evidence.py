"""What the decision needs of simulated sessions, kept for learning: a Parquet file each."""

import json
import os
import subprocess
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from pipelines.diagnosis.criteria import BEFORE_EVIDENCE, CRITERIA
from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.examine import Folders, neutral_name, prepare
from tests.campaigns.learn.packing import packed

SOURCES = (
    "pipelines",
    "tests/campaigns/blind",
    ":!pipelines/diagnosis/criteria.py",
    ":!pipelines/diagnosis/criteria_measured.json",
)
"""What evidence depends on, as git names it; of the criteria it depends on those of
``BEFORE_EVIDENCE`` alone."""
CHANGED = ", changed"
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def write_evidence(
    cases: Sequence[Case], root: Path, workers: int, keep: bool = False
) -> Iterator[str]:
    """Simulate cases and keep their evidence; yield names as they are done.

    What is there already, of the same revision, is left as it is, so that a campaign goes on where
    it was stopped. Recordings are removed afterwards unless ``keep``.
    """
    for name in ONE_THREAD:
        os.environ[name] = "1"
    current = current_revision()
    changed = current.endswith(CHANGED)
    missing = [case for case in cases if changed or _stored_revision(_place(root, case)) != current]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        pending = [pool.submit(_one, case, root, current, keep) for case in missing]
        for done in as_completed(pending):
            yield done.result()


def current_revision() -> str:
    """Return the last commit that changed what evidence depends on, and whether it was changed
    since."""

    def git(*arguments: str) -> str:
        command = ["git", *arguments, "--", *SOURCES]
        folder = Path(__file__).parents[3]
        return subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=True
        ).stdout.strip()

    values = (f", {name} {getattr(CRITERIA, name):g}" for name in BEFORE_EVIDENCE)
    return "".join(
        [git("log", "-1", "--format=%h"), *values, CHANGED if git("status", "--porcelain") else ""]
    )


def _stored_revision(place: Path) -> str | None:
    """Return the revision that made a row; None where there is none, or it has no revision."""
    if not place.exists() or "revision" not in pq.read_schema(place).names:
        return None
    return str(pq.read_table(place, columns=["revision"])["revision"][0].as_py())


def _place(root: Path, case: Case) -> Path:
    return root / "evidence" / case.world / f"{neutral_name(case)}.parquet"


def _one(case: Case, root: Path, revision: str, keep: bool) -> str:
    """Write one case's evidence, or why there is none."""
    folders, name = Folders(root), neutral_name(case)
    prepare(case, folders)
    truth = json.loads(folders.truth(name).read_text())
    row = evidence_row(folders.recordings(name))
    row |= {
        "name": name,
        "world": case.world,
        "seed": case.seed,
        "revision": revision,
        "truth": json.dumps(truth),
    }
    place = _place(root, case)
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_suffix(".part")
    pq.write_table(pa.Table.from_pylist([row]), part, compression="zstd")
    part.rename(place)
    if not keep:
        for file in folders.recordings(name).glob("*.parquet"):
            file.unlink()
    return name


def evidence_row(recordings: Path) -> dict[str, Any]:
    """Return the evidence of a folder of recordings, packed; why there is none in ``refused``."""
    from pipelines.diagnosis.evidence.prepared_runs import prepare as prepared
    from pipelines.diagnosis.selection.selection import weighed
    from pipelines.diagnosis.training_data import training_data
    from pipelines.errors import ExoidError
    from pipelines.mechanics.read import read_motions
    from pipelines.settings.filter import FilterSettings

    began = time.process_time()
    empty = {"gram": b"", "right": b"", "text": "", "refused": ""}
    try:
        motions = read_motions(sorted(recordings.glob("*.parquet")), FilterSettings(), None)
        data = training_data(motions)
        _, evidence, _ = weighed(prepared(data.train, data.baseline))
        row = empty | packed(evidence)
    except ExoidError as error:
        row = empty | {"refused": str(error)}
    return row | {"seconds": time.process_time() - began}
