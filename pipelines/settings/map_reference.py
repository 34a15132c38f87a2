"""The page docs/import-map.md from the map's settings themselves; `make docs` writes it."""

from pipelines.settings.import_map import ImportMap
from pipelines.settings.reference import grouped_sections
from pipelines.settings.transmission import GEARED, paths
from pipelines.settings.units import ALIASES, UNITS

INTRODUCTION = """\
# Every key of a map for `exoid import`

Written by `make docs` from `pipelines/settings/`; change it there. [import.md](import.md) explains
how to write a map.

`rig`, the name of the machine, is outside of all tables.
"""


def reference() -> str:
    """Return the page as Markdown."""
    sections = [*grouped_sections(ImportMap), _units(), _drive_trains()]
    return "\n\n".join([INTRODUCTION.rstrip(), *sections]) + "\n"


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
    print(reference(), end="")
