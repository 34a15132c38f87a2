"""What the decision needs of simulated sessions, kept for learning: a Parquet file each."""

import json
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from tests.blind.cases import Case
from tests.blind.examine import Folders, neutral_name, prepare

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def write_evidence(cases: Sequence[Case], root: Path, workers: int, keep: bool = False) -> Iterator[str]:
    """Simulate cases and keep their evidence; yield names as they are done.

    What is there already is left as it is, so that a campaign goes on where it was stopped.
    Recordings are removed afterwards unless ``keep``.
    """
    for name in ONE_THREAD:
        os.environ[name] = "1"
    missing = [case for case in cases if not _place(root, case).exists()]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        pending = [pool.submit(_one, case, root, keep) for case in missing]
        for done in as_completed(pending):
            yield done.result()


def _place(root: Path, case: Case) -> Path:
    return root / "evidence" / case.world / f"{neutral_name(case)}.parquet"


def _one(case: Case, root: Path, keep: bool) -> str:
    """Write one case's evidence, or why there is none."""
    folders, name = Folders(root), neutral_name(case)
    prepare(case, folders)
    truth = json.loads(folders.truth(name).read_text())
    row = evidence_row(folders.recordings(name))
    row |= {"name": name, "world": case.world, "seed": case.seed, "truth": json.dumps(truth)}
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
    from pipelines.diagnosis.selection.selected import evidence_of
    from pipelines.errors import ExoidError
    from pipelines.mechanics.read import read_motions
    from pipelines.settings.filter import FilterSettings

    began = time.process_time()
    empty = {"gram": b"", "right": b"", "text": "", "refused": ""}
    try:
        motions = read_motions(sorted(recordings.glob("*.parquet")), FilterSettings(), None)
        row = empty | evidence_of(motions).packed()
    except ExoidError as error:
        row = empty | {"refused": str(error)}
    return row | {"seconds": time.process_time() - began}
