"""One run in several files, joined by their clocks."""

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from pipelines.errors import InputError, about
from pipelines.importing.sources.open import open_source
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings

TWIN = re.compile(r"#\d+$")
"""Number of a file at a name that an earlier file has, too."""


def open_run(
    path: Path, settings: SourceSettings, clock: str | None, others: Collection[str] = ()
) -> Source:
    """Return the log in a file, or in the files of a run.

    Parameters
    ----------
    path : Path
        Any file of the run.
    settings : SourceSettings
        ``join`` names its files.
    clock : str or None
        The column of the clock.
    others : collection of str
        Columns of the clocks of files that have another one.

    Raises
    ------
    InputError
        If a file cannot be read, or has none of these clocks.
    """
    if settings.join is None:
        return open_source(path, settings)
    sources = []
    for part in parts_of(path, settings.join):
        with about(part if part != path else None):
            sources.append(open_source(part, settings))
    return joined(sources, str(clock), others)


def firsts(files: Sequence[Path], join: Sequence[str] | None) -> list[Path]:
    """Return the first file of each run that the files are of, each once.

    Parameters
    ----------
    files : sequence of Path
        Files that the user gives; any of a run stands for it.
    join : sequence of str or None
        Patterns of the files of a run; None where each file is a run.

    Raises
    ------
    InputError
        If a file fits none of the patterns.
    """
    if join is None:
        return list(files)
    return list(dict.fromkeys(parts_of(file, join)[0] for file in files))


def parts_of(file: Path, join: Sequence[str]) -> list[Path]:
    """Return the files of the run that a file is of, in the order of the patterns.

    Raises
    ------
    InputError
        If the file fits none of the patterns.
    """
    for pattern in join:
        run = re.fullmatch(re.escape(pattern).replace(r"\*", "(.*)"), file.name)
        if run is not None:
            name = run[1] if run.groups() else ""
            return [file.with_name(other.replace("*", name)) for other in join]
    raise InputError(
        f"{file}: is none of the files {', '.join(join)}, which source.join in the map names"
    )


def joined(sources: Sequence[Source], clock: str, others: Collection[str] = ()) -> Source:
    """Return the files of one run as one log.

    Columns of the other files keep their names, or get the number of the file if the name is taken:
    ``t#2``. Their clock is that of their own file.

    Parameters
    ----------
    sources : sequence of Source
        The files of a run.
    clock : str
        The column of the clock, which a file has under this name if it has none of ``others``.
    others : collection of str
        Columns of other clocks, by their names in the joined log.

    Raises
    ------
    InputError
        If a file has none of these columns, or several of the others.
    """
    places: dict[str, tuple[Source, str]] = {}
    clocks: dict[str, str] = {}
    units: dict[str, str] = {}
    scaling: dict[str, str] = {}
    of_files = []
    for number, source in enumerate(sources, 1):
        called = {name: f"{name}#{number}" if name in places else name for name in source.names}
        # The caller names the first file, which stands for the run.
        with about(source.path if number > 1 else None):
            of_file = _clock_of(called, clock, others)
        of_files.append(of_file)
        places |= {called[name]: (source, name) for name in source.names}
        units |= {called[name]: unit for name, unit in source.units.items()}
        scaling |= {called[name]: text for name, text in source.scaling.items()}
        clocks |= {name: of_file for name in called.values() if name != of_file}
        clocks |= {called[name]: called[own] for name, own in source.clocks.items()}

    def load(names: Sequence[str]) -> Columns:
        columns: Columns = {}
        for source in sources:
            own = {name: places[name][1] for name in names if places[name][0] is source}
            loaded = source.load(list(own.values()))
            columns |= {name: loaded[inner] for name, inner in own.items()}
        return columns

    first, *rest = sources
    distinct = list(dict.fromkeys(places[name][1] for name in of_files))
    by = f"the clock{'s' if len(distinct) > 1 else ''} {', '.join(map(repr, distinct))}"
    remark = f"joined with {', '.join(one.path.name for one in rest)} by {by}"
    return Source(
        first.path,
        first.format,
        tuple(places),
        load,
        (*first.notes, remark),
        units=units,
        clocks=clocks,
        scaling=scaling,
        stated=tuple(f"{one.path.name}, {words}" for one in sources for words in one.stated),
        remarks=(*(remark for one in sources for remark in one.remarks), remark),
    )


def _clock_of(called: Mapping[str, str], clock: str, others: Collection[str]) -> str:
    """Return the clock of a file, by its name in the joined log.

    The file's columns are given by their own names, with those in the joined log.
    """
    if clock in called.values():
        return clock
    # The clock of the log may be that of a later file, which has it as t#2.
    same = called.get(TWIN.sub("", clock))
    if same is not None:
        return same
    own = [name for inner, name in called.items() if {inner, name} & set(others)]
    if len(own) == 1:
        return own[0]
    if own:
        raise InputError(
            f"has the clocks {', '.join(own)} in the map, expected one in each file that is joined"
        )
    raise InputError(
        f"has no column {clock!r}, the clock by which files are joined; if its clock has another"
        " name, set that as time of its channels, and its time_unit"
    )
