"""``make peers``: the same recordings through exoid and other tools, and docs/peers.md from what came of it."""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

# Before NumPy is loaded: two legs at a time, a core for each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.peers import compare
from tests.peers.page import page

DATA = Path(os.environ.get("EXOID_REAL_DATA") or Path(__file__).parents[3] / "shared" / "data")


def main() -> None:
    """Compare, and write the page."""
    asked = argparse.ArgumentParser(prog="python -m tests.peers", description=__doc__)
    asked.add_argument("page", type=Path, help="where the page goes")
    asked.add_argument("--legs", type=int, default=8, help="simulated legs with nothing hidden")
    asked.add_argument("--sprung", type=int, default=4, help="simulated legs with a hidden spring")
    asked.add_argument("--out", type=Path, default=Path("build/peers"), help="results there are used again")
    told = asked.parse_args()
    # Spawned: numba's threads do not survive a fork.
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        plain = [pool.submit(compare.leg, k, False, told.out) for k in range(told.legs)]
        sprung = [pool.submit(compare.leg, k, True, told.out) for k in range(told.sprung)]
        real = pool.submit(compare.double_pendulum, DATA, told.out) if DATA.is_dir() else None
        if real is None:
            print(f"no real data in {DATA}: the page goes without them")
        results = [[one.result() for one in many] for many in (plain, sprung)]
        text = page(*results, real.result() if real else None)
    told.page.write_text(text, encoding="utf-8")
    print(f"wrote {told.page}")


if __name__ == "__main__":
    main()
