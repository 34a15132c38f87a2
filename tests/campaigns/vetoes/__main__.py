"""Count false vetoes and faults that are named (``make vetoes``).

python -m tests.campaigns.vetoes docs/vetoes.md --sessions 240
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing import get_context
from pathlib import Path

# Before NumPy is loaded: each session has a core of its own.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.campaigns.blind.cases import Case, mixed, of_one_joint
from tests.campaigns.blind.causes import WORLDS
from tests.campaigns.blind.seeds import RANGES
from tests.campaigns.real.folder import real_data_folder
from tests.campaigns.vetoes.page import page
from tests.campaigns.vetoes.sessions import REAL, real, simulated

MIX = {"single": 0.5, "none": 0.1, "imperfect": 0.1, "pair": 0.15, "outside": 0.15}
"""Shares of the sessions that hide one effect, nothing, small ones, two, or an unlisted one."""
MIX_OF_ONE_JOINT = {"single": 0.6, "none": 0.15, "outside": 0.25}
"""The same of machines of one joint, some of which have too few small effects to draw from."""


def planned(sessions: int, seed_base: int) -> list[Case]:
    """Return the simulated sessions: a fifth of machines of one joint, the rest of all worlds."""
    single = sessions // 5
    return mixed(sessions - single, seed_base, MIX, tuple(WORLDS)) + of_one_joint(
        single, seed_base + sessions, MIX_OF_ONE_JOINT
    )


def main() -> None:
    """Examine what has no outcome yet, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.vetoes", description=__doc__)
    parser.add_argument("page", type=Path, nargs="?", default=Path("docs/vetoes.md"))
    parser.add_argument("--sessions", type=int, default=240)
    parser.add_argument("--faults", type=int, default=4, help="faults in each session")
    parser.add_argument("--seed-base", type=int, default=RANGES["tuning"].start + 200_000)
    parser.add_argument("--out", type=Path, default=Path("build/vetoes"))
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args()
    root, data = chosen.out.resolve(), real_data_folder()
    tasks = [
        partial(simulated, case, number, root, chosen.faults)
        for number, case in enumerate(planned(chosen.sessions, chosen.seed_base))
    ]
    if data.is_dir():
        tasks += [partial(real, name, k, root, data, 15) for k, name in enumerate(REAL)]
    with ProcessPoolExecutor(chosen.workers, get_context("spawn")) as pool:
        pending = [pool.submit(task) for task in tasks]
        results = [one for done in as_completed(pending) for one in done.result()]
    command = (
        f"python -m tests.campaigns.vetoes --sessions {chosen.sessions}"
        f" --seed-base {chosen.seed_base}"
    )
    chosen.page.write_text(page(results, command), encoding="utf-8")


if __name__ == "__main__":
    main()
