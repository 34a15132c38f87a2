"""``make fuzz``: hostile replies against the client, hostile requests against the rig; exit code 1
if any did harm."""

import argparse
import asyncio
import json
import sys
from pathlib import Path

from tests.campaigns.fuzz import replies, requests
from tests.campaigns.fuzz.outcome import Outcome


def main() -> int:
    """Fuzz, or replay one input that did harm."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=60_000, help="of each of the two kinds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--replay", type=Path, help="a file in build/fuzz")
    wanted = parser.parse_args()
    if wanted.replay:
        kept = json.loads(wanted.replay.read_text())
        outcomes = [run(kept["target"], kept["seed"], 1, kept["index"])]
    else:
        outcomes = [run(target, wanted.seed, wanted.inputs) for target in ("replies", "requests")]
    return int(any(outcome.failures for outcome in outcomes))


def run(target: str, seed: int, inputs: int, only: int | None = None) -> Outcome:
    """Fuzz one side and print what came of it."""
    outcome = (
        asyncio.run(replies.fuzz(seed, inputs, only))
        if target == "replies"
        else requests.fuzz(seed, inputs, only)
    )
    print(outcome, flush=True)
    return outcome


sys.exit(main())
