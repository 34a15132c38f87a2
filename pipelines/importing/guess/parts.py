"""Find out whether files are the parts of runs, to be joined by their clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.errors import about
from pipelines.importing.guess.joints import TURNING
from pipelines.importing.guess.own_clocks import EQUALLY_FAST
from pipelines.importing.naming.meaning import Meaning, meaning
from pipelines.importing.sources.joined import firsts, open_run
from pipelines.importing.sources.open import open_source
from pipelines.importing.sources.source import Source
from pipelines.settings.import_map import SourceSettings


@dataclass(frozen=True)
class Join:
    """Files of one run."""

    patterns: tuple[str, ...]
    clocks: tuple[str, ...]
    """Column of the clock of each file."""


def opened(path: Path, join: Join | None) -> Source:
    """Return the log in a file, or in the files of a run."""
    if join is None:
        return open_source(path, SourceSettings())
    return open_run(path, SourceSettings(join=join.patterns), join.clocks[0], join.clocks)


def runs_to_join(paths: Sequence[Path]) -> tuple[list[Path], Join | None]:
    """Return the first file of each run, and how its files are joined if they are several.

    Files whose columns differ but for the clock are parts of a run.
    """
    kinds: dict[tuple[str, ...], list[Path]] = {}
    for path in paths if len(paths) > 1 else ():
        with about(path):
            kinds.setdefault(open_source(path, SourceSettings()).names, []).append(path)
    meanings = [[meaning(name) for name in names] for names in kinds]
    clocks = _clocks(meanings)
    patterns = _patterns(list(kinds.values()))
    if len(kinds) < 2 or patterns is None or clocks is None:
        return list(paths), None
    rows = [_rows(files[0], name) for files, name in zip(kinds.values(), clocks, strict=True)]
    drives = [any(m.quantity in TURNING for m in names) for names in meanings]
    # The slowest clock first: straight lines are accurate between samples closer than the rows. Of
    # equally fast ones the torque's, as angles are smoother.
    order = sorted(
        range(len(kinds)), key=lambda k: (rows[k] > EQUALLY_FAST * min(rows), not drives[k])
    )
    join = Join(tuple(patterns[k] for k in order), tuple(clocks[k] for k in order))
    return firsts(paths, join.patterns), join


def _clocks(kinds: Sequence[Sequence[Meaning]]) -> list[str] | None:
    """Return the clock of each kind of files; None where they are no parts of a run.

    Nothing but the clock is in several files. Where the clocks have different names, no file has
    both angle and torque, as such a file is a log of its own.
    """
    names = [{m.column for m in kind} for kind in kinds]
    common = set.intersection(*names) if names else set()
    if common:
        shared = [m for m in kinds[0] if m.column in common]
        one = [m.quantity for m in shared] == ["time"]
        return [shared[0].column] * len(kinds) if one else None
    clocks = [[m.column for m in kind if m.quantity == "time"] for kind in kinds]
    quantities = [{m.quantity for m in kind} for kind in kinds]
    is_log = any("angle" in own and own & set(TURNING) for own in quantities)
    if is_log or any(len(own) != 1 for own in clocks):
        return None
    columns = [m.column for kind in kinds for m in kind if m.quantity != "time"]
    return [own[0] for own in clocks] if len(set(columns)) == len(columns) else None


def _rows(path: Path, clock: str) -> int:
    """Return the number of rows of a file."""
    with about(path):
        return len(open_source(path, SourceSettings()).load([clock])[clock])


def _patterns(kinds: Sequence[Sequence[Path]]) -> list[str] | None:
    """Return the names of the files of each kind, with * for the run; None if runs do not show."""
    if len({len(paths) for paths in kinds}) != 1:
        return None
    if all(len(paths) == 1 for paths in kinds):
        return [paths[0].name for paths in kinds]
    patterns, runs = [], []
    for paths in kinds:
        names = [path.name for path in paths]
        begin = _common_start(names)
        end = _common_start([name[len(begin) :][::-1] for name in names])[::-1]
        patterns.append(f"{begin}*{end}")
        runs.append({name[len(begin) : len(name) - len(end)] for name in names})
    return patterns if all(run == runs[0] for run in runs) else None


def _common_start(names: Sequence[str]) -> str:
    """Return the letters with which all names begin."""
    same = 0
    for letters in zip(*names, strict=False):
        if len(set(letters)) > 1:
            break
        same += 1
    return names[0][:same]
