"""What a fuzzed input came to, and where a failing one is kept."""

from __future__ import annotations

import json
import resource
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

HANG_S = 5.0
"""Many times what any time-out in a fuzzed rig comes to, so that a busy machine is not taken for a
fault."""
MEMORY_MIB = 64.0
"""How much either side may grow by."""
KEPT = Path("build/fuzz")


@dataclass
class Outcome:
    """Counts of a target, its slowest input, and how much memory it took."""

    target: str
    seed: int
    inputs: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    worst_s: float = 0.0
    grown_mib: float = 0.0
    failures: list[str] = field(default_factory=list)

    def count(self, what: str, seconds: float) -> None:
        """Note one operation."""
        self.counts[what] += 1
        self.worst_s = max(self.worst_s, seconds)

    def fail(self, index: int, why: str, transcript: list[str]) -> None:
        """Keep a failing input: its seed and number make it again, the transcript is to read."""
        KEPT.mkdir(parents=True, exist_ok=True)
        path = KEPT / f"{self.target}-{self.seed}-{index}.json"
        kept = {
            "target": self.target,
            "seed": self.seed,
            "index": index,
            "why": why,
            "transcript": transcript,
        }
        path.write_text(json.dumps(kept, indent=1))
        self.failures.append(f"{why} (replay: python -m tests.campaigns.fuzz --replay {path})")

    def check_memory(self) -> None:
        """Fail where memory grew without bound."""
        if self.grown_mib > MEMORY_MIB:
            self.failures.append(
                f"memory grew by {self.grown_mib:.0f} MiB, at most {MEMORY_MIB:.0f} MiB are"
                " expected"
            )

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {what}" for what, count in self.counts.most_common())
        lines = [
            f"{self.target}: {self.inputs} inputs, seed {self.seed}: {counts}; worst"
            f" {self.worst_s:.2f} s, memory grew by {self.grown_mib:.1f} MiB, {len(self.failures)}"
            " failures"
        ]
        return "\n".join(lines + [f"  {failure}" for failure in self.failures[:20]])


def peak_mib(process: int | None = None) -> float:
    """Return the most memory that a process has held, this one by default."""
    if process is None:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024
