"""``make peers``: the same recordings through exoid and other tools, and docs/peers.md from what
came of it."""

import argparse
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

# Before NumPy is loaded: two legs at a time, a core for each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.campaigns.peers import compare
from tests.campaigns.peers.page import page
from tests.campaigns.real.folder import real_data_folder


def main() -> None:
    """Compare, and write the page."""
    asked = argparse.ArgumentParser(prog="python -m tests.campaigns.peers", description=__doc__)
    asked.add_argument("page", type=Path, help="where the page goes")
    asked.add_argument("--legs", type=int, default=8, help="simulated legs with nothing hidden")
    asked.add_argument("--sprung", type=int, default=4, help="simulated legs with a hidden spring")
    asked.add_argument(
        "--resume", type=Path, help="folder that keeps results; those that are there are used again"
    )
    told, data = asked.parse_args(), real_data_folder()
    # Spawned: numba's threads do not survive a fork.
    with (
        tempfile.TemporaryDirectory() as anew,
        ProcessPoolExecutor(2, get_context("spawn")) as pool,
    ):
        out = told.resume or Path(anew)
        plain = [pool.submit(compare.leg, k, False, out) for k in range(told.legs)]
        sprung = [pool.submit(compare.leg, k, True, out) for k in range(told.sprung)]
        real = pool.submit(compare.double_pendulum, data, out) if data.is_dir() else None
        if real is None:
            print(f"no real data in {data}: the page goes without them")
        results = [[one.result() for one in many] for many in (plain, sprung)]
        text = page(*results, real.result() if real else None)
    told.page.write_text(text, encoding="utf-8")
    print(f"wrote {told.page}")


if __name__ == "__main__":
    main()
