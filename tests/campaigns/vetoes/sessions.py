"""Sessions to examine: simulated ones of every world, and other people's recordings."""

from collections.abc import Iterator
from pathlib import Path

from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.examine import Folders, neutral_name, prepare
from tests.campaigns.real.machines import LOGS, recordings
from tests.campaigns.vetoes.examination import Outcome, kept, outcomes, read

REAL = [name for name, logs in LOGS.items() if not logs.known]


def simulated(case: Case, number: int, root: Path, faults: int) -> list[Outcome]:
    """Return the outcomes of one simulated session."""
    name, folders = neutral_name(case), Folders(root)

    def make() -> Iterator[Outcome]:
        prepare(case, folders)
        world = case.world if case.machine == "leg" else "one joint"
        yield from outcomes(read(folders.recordings(name)), world, name, case.label, number, faults)

    return kept(root / "outcomes" / f"{name}.json", make)


def real(name: str, number: int, root: Path, data: Path, faults: int) -> list[Outcome]:
    """Return the outcomes of one machine's recordings."""
    folder = root / "real" / name

    def make() -> Iterator[Outcome]:
        if not any(folder.glob("*.parquet")):
            recordings(LOGS[name], data, folder)
        yield from outcomes(read(folder), "real", name, "", number, faults)

    return kept(root / "outcomes" / f"real-{name}.json", make)
