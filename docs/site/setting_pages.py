"""The pages of all settings, from the settings themselves: ``python docs/site/setting_pages.py``.

docs/settings.md has the keys of exoid.toml, docs/import-map.md those of a map, and docs/rig-keys.md
those of a rig file. A test fails if one of them is outdated.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipelines.settings.base import models_in
from pipelines.settings.experiment import Experiment
from pipelines.settings.import_map import ImportMap
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.recording_only import RecordingRig
from pipelines.settings.transmission import GEARED, paths
from pipelines.settings.units import ALIASES, UNITS

EXPERIMENT = """\
# Settings: every key of exoid.toml

Written by `make docs` from `pipelines/settings/`; change it there. Every key may be left out.
`datasets/experiments/default.toml` is a complete file to start from.
"""
MAP = """\
# Every key of a map for `exoid import`

Written by `make docs` from `pipelines/settings/`; change it there. [import.md](import.md) explains
how to write a map.

`rig`, the name of the machine, is outside of all tables.
"""
RIG = """\
# Every key of a rig file

Written by `make docs` from `pipelines/settings/rig/`; change it there. [rig.md](rig.md) explains
the parts of a rig file, and [rig-file.md](rig-file.md) how to write one. `NAME` stands for a name
of your own.

## Outside of all tables
"""
RECORDING_ONLY = """\
## With `recording_only = true`, outside of all tables

The tables below differ then; [recording-only.md](recording-only.md) explains them.

"""
HEAD = "| key | default | meaning |\n|---|---|---|\n"


def experiment_page() -> str:
    """Return docs/settings.md."""
    tables = [(heading, model, list(rows_of(model))) for heading, model in sections_of(Experiment)]
    sections = [
        f"## {heading}\n\n{model.__doc__}\n\n{HEAD}" + "\n".join(rows)
        for heading, model, rows in tables
        if rows
    ]
    return _page(EXPERIMENT, *sections)


def map_page() -> str:
    """Return docs/import-map.md."""
    return _page(MAP, *grouped_sections(ImportMap), _units(), _drive_trains())


def rig_page() -> str:
    """Return docs/rig-keys.md."""
    own = HEAD + "\n".join(rows_of(RigSettings))
    sections = list(grouped_sections(RigSettings))
    # Tables that both kinds of rig file have are listed once.
    read_only = [one for one in grouped_sections(RecordingRig) if one not in sections]
    only = RECORDING_ONLY + HEAD + "\n".join(rows_of(RecordingRig))
    return _page(RIG, own, *sections, only, *read_only)


PAGES = {"settings": experiment_page, "import-map": map_page, "rig-keys": rig_page}


def _page(introduction: str, *sections: str) -> str:
    return "\n\n".join([introduction.rstrip(), *sections]) + "\n"


def sections_of(model: type[BaseModel], path: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield every table below a model with its heading, ``[design]`` or ``[[run]]``."""
    for name, field in model.model_fields.items():
        for inner in models_in(field.annotation):
            # Tables of a dict have names of the user's own.
            place = f"{path}{name}.NAME" if get_origin(field.annotation) is dict else path + name
            yield (f"[[{place}]]" if get_origin(field.annotation) is tuple else f"[{place}]"), inner
            yield from sections_of(inner, f"{place}.")


def grouped_sections(model: type[BaseModel]) -> Iterator[str]:
    """Yield a section of Markdown for each kind of table below a model, with all its headings."""
    # Most headings of a section's title; more stand below it.
    most = 6
    # Least number of rows that are not repeated, but named with their other table.
    many = 10
    above: dict[str, str] = {}
    headings: dict[type[BaseModel], dict[str, None]] = {}
    for heading, inner in sections_of(model):
        headings.setdefault(inner, {})[f"`{heading}`"] = None
    for inner, names in headings.items():
        rows = list(rows_of(inner))
        if not rows:
            continue
        title, about = ", ".join(names), inner.__doc__ or ""
        if len(names) > most:
            title, about = inner.__name__, f"{about}\n\nTables: {title}."
        repeated = [row for row in rows if row in above]
        if len(repeated) >= many:
            first, last = (row.split("|")[1].strip() for row in (repeated[0], repeated[-1]))
            about = f"{about}\n\n{first} to {last} as of {above[repeated[0]]}; in addition:"
            rows = [row for row in rows if row not in above]
        above |= dict.fromkeys(rows, title.split(",")[0])
        yield f"## {title}\n\n{about}\n\n{HEAD}" + "\n".join(rows)


def rows_of(model: type[BaseModel]) -> Iterator[str]:
    """Yield a row of Markdown for each key of a table, except subtables."""
    for name, field in model.model_fields.items():
        # A subtable has a section of its own.
        if not any(models_in(field.annotation)):
            yield f"| `{name}` | {_default(field)} | {field.description} |"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    default = field.get_default(call_default_factory=True)
    return "none" if default is None else f"`{json.dumps(default)}`"


def _units() -> str:
    names: dict[str, list[str]] = {}
    for name, unit in UNITS.items():
        names.setdefault(unit.dimension, []).append(f"`{name}`")
    rows = [f"| {dimension} | {', '.join(own)} |" for dimension, own in names.items()]
    also = ", ".join(f"`{alias}` for `{name}`" for alias, name in ALIASES.items())
    return (
        "## Units\n\n| of | written |\n|---|---|\n" + "\n".join(rows) + f"\n\nAlso known: {also}."
    )


def _drive_trains() -> str:
    """Return the keys that convert each dimension of a log to that at the joint."""
    dimensions = dict.fromkeys(unit.dimension for unit in UNITS.values())
    rows = [
        f"| {source} | {target} | {' and '.join(f'`{step.key}`' for step in way)} |"
        f" {_geared(target)} |"
        for target in GEARED
        for source in dimensions
        for way in paths(source, target)
        if way
    ]
    head = "| reading of | at the joint | needs | `gear_ratio` |\n|---|---|---|---|\n"
    return "## From the motor to the joint\n\n" + head + "\n".join(rows)


def _geared(target: str) -> str:
    return {1: "multiplies", -1: "divides", 0: "is not used"}[GEARED[target]]


if __name__ == "__main__":
    for name, page in PAGES.items():
        (Path(__file__).parents[1] / f"{name}.md").write_text(page(), encoding="utf-8")
